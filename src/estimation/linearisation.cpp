// The dual-number instantiations of plant and engine. They take longer to compile than any other file of the
// fit and are therefore alone in this one.
#include "linearisation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "attached_start.hpp"
#include "model/rigid_body.hpp"
#include "segment_start.hpp"
#include "state_vector.hpp"
#include "upright/model/dual_number.hpp"
#include "upright/model/elementary.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {

namespace {

EngineOptions engine_options() {
  EngineOptions options;
  // The error of quick derivatives grows with the square of the step. At this length it is below a hundredth,
  // which a fit does not notice. Records of 100 Hz take one step from sample to sample.
  options.max_step_s = 10e-3;
  options.step_fraction = 0.5;
  options.resolve_bristles = false;
  options.resolve_lag = false;
  options.quick_derivatives = true;
  options.event_tolerance_s = 1e-9;
  return options;
}

/// Whether a filter has lost the plant, by its steps from one sample to the next. What holds its speed may be
/// missing in a trial point. A speed without limit then crosses a force of the place in steps without number.
bool is_lost(double period_s, std::uint64_t steps) {
  constexpr double shortest_mean_step_s = 1e-5;  // 4 m/s across the shortest pitch that is searched, 0.5 mm
  constexpr double extra_steps = 100.0;          // more than any sample begins with
  return static_cast<double>(steps) > extra_steps + period_s / shortest_mean_step_s;
}

double measured(const Measurement& run, int channel, std::size_t k) {
  return channel == 0 ? run.cart_m[k] : run.theta_rad[k];
}

double weight_of(const Measurement& run, int channel, std::size_t k) {
  const std::vector<double>& weights = channel == 0 ? run.cart_weight : run.theta_weight;
  return weights.empty() ? 1.0 : weights[k];
}

/// Adds a filter's correction to the state of an engine.
template <class S>
void correct_state(EventEngine<S>& engine, const double (&correction)[state_count]) {
  if (std::all_of(correction, correction + state_count, [](double u) { return u == 0.0; })) return;
  PlantState<S> state = engine.state();
  const auto values = as_array(state);
  for (int i = 0; i < state_count; ++i)
    if (correction[i] != 0.0) *values[static_cast<std::size_t>(i)] += S(correction[i]);
  engine.correct(state);
}

/// At which a cart at rest begins to slide, in the direction in which it does so sooner.
template <class S>
double min_dry_level(const Dynamics<S>& dynamics, const PlantState<S>& at_rest) {
  return std::min(value_of(dynamics.cart_dry_level(at_rest, at_rest.motor_v, S(0.0), S(1.0))),
                  value_of(dynamics.cart_dry_level(at_rest, at_rest.motor_v, S(0.0), S(-1.0))));
}

/// What the cart's sensor shows of a unit of its speed: through back-EMF a drive that gives way is set back.
/// Too little to count in a filter's gain, but derivatives are of all that is shown.
template <class S>
double shown_of_cart_speed_s(const Dynamics<S>& dynamics) {
  PlantState<S> unit;
  unit.cart_mps = S(1.0);
  return value_of(dynamics.measure(unit).cart_m) - value_of(dynamics.measure(PlantState<S>{}).cart_m);
}

/// Adds weight * row * row' to the columns of a matrix, of which the lower triangle counts.
template <int N>
void add_square(const Derivatives<N>& row, double weight, int columns, std::array<Derivatives<N>, N>& sum) {
  for (int j = 0; j < columns; ++j) sum[static_cast<std::size_t>(j)].add_from(j, weight * row[j], row);
}

/// How a white force and torque enter the velocities. They are pushed through the plant file's own masses:
/// were they the fitted ones, the fit could shrink its noise by making the plant heavier.
class NoiseInput {
 public:
  NoiseInput(const Plant& plant, bool cart_locked) : cart_locked_(cart_locked), body_(rigid_body(plant)) {}

  void set(LinearStep& step, double theta_rad) const {
    const InverseMass inverse =
        cart_locked_ ? inverse_mass_at_held_cart(body_) : inverse_mass(body_, std::cos(theta_rad));
    step.by_force[0] = inverse.cart_by_force;
    step.by_force[1] = step.by_torque[0] = inverse.coupled;
    step.by_torque[1] = inverse.pendulum_by_torque;
  }

 private:
  bool cart_locked_;
  RigidBody body_;
};

/// Sums the objective of a segment by blocks of time.
class BlockSums {
 public:
  explicit BlockSums(std::vector<double>& blocks) : blocks_(blocks) { blocks_.clear(); }

  /// The objective of all samples up to one at `time_s`.
  void reach(double time_s, double objective) {
    constexpr double block_s = 0.25;
    if (time_s >= block_end_s_) {
      blocks_.push_back(0.0);
      block_end_s_ = time_s + block_s;
    }
    blocks_.back() += objective - counted_;
    counted_ = objective;
  }

 private:
  std::vector<double>& blocks_;
  double block_end_s_ = -std::numeric_limits<double>::infinity(), counted_ = 0.0;
};

/// Follows a segment with dual numbers of N derivatives, a sample at a time; chains the derivatives and
/// whitens them on the way. As in the dual numbers stands in every row: initial state first, then parameters,
/// then nothing.
template <int N>
class SegmentLineariser {
 public:
  SegmentLineariser(const Measurement& run, const Segment& segment, const FitPoint& point,
                    const PlantState<double>& start, const std::vector<FreeParameter>& free)
      : run_(run),
        segment_(segment),
        states_(estimated_states(point.plant)),
        columns_(states_ + static_cast<int>(free.size())),
        simulator_(model_of(run, point.plant, free), engine_options(), max_commands(run, segment)),
        sensors_(sensor_gains(dynamics().model())),
        shown_of_speed_s_(shown_of_cart_speed_s(dynamics())),
        noise_input_(point.plant, run.cart_locked),
        covariance_(run, point.plant, noise_of_filter(point.noise)) {
    start_segment(simulator_, run, segment, constant_state(start));
    // A correction is in the sensors' units: to a state it is worth as much less as they show more of it.
    for (std::size_t channel = 0; channel < 2; ++channel)
      worth_less_[channel] = sensors_[channel].v / sensors_[channel].a;
    start_sensitivity(start);
    if (is_driven_by_cart(point.plant)) start_attached_sensitivity(point.plant, start, free);
  }

  /// With the normal equations, or for a null pointer without.
  void run(std::vector<LinearStep>& steps, NormalEquations* normal) {
    steps.resize(segment_.last - segment_.first + 1);
    NormalEquations unused;
    NormalEquations& sums = normal != nullptr ? *normal : unused;
    const int rows = outward(columns_);
    sums.information.setZero(rows, rows);
    sums.score.setZero(rows);
    sums.likelihood = {};
    BlockSums blocks(sums.blocks);
    for (std::size_t k = segment_.first; k <= segment_.last; ++k) {
      LinearStep& step = steps[k - segment_.first];
      const Outputs<Dual> outputs = simulate_to(k, step);
      if (k != segment_.first) {
        set_impulse(step, steps[k - 1 - segment_.first]);
        covariance_.predict(step);
        if (normal != nullptr) carry_sensitivity(step);
      }
      if (!update(step, outputs, normal)) return;
      if (k != segment_.last) push_by_disturbances(run_.time_s[k + 1] - run_.time_s[k], step);
      correct_state(simulator_.engine(), step.correction);
      if (normal != nullptr) blocks.reach(run_.time_s[k], sums.likelihood.objective());
    }
    if (normal == nullptr) return;
    for (int j = 0; j < columns_; ++j) {
      for (int i = j; i < columns_; ++i)
        sums.information(outward(i), outward(j)) = sums.information(outward(j), outward(i)) =
            information_[static_cast<std::size_t>(j)][i];
      sums.score[outward(j)] = score_[j];
    }
  }

 private:
  using Dual = DualNumber<N>;
  using Row = Derivatives<N>;

  /// The states that every plant has in a loop of fixed length, which is faster, and then the others.
  template <class Visit>
  void for_each_state(const Visit& visit) const {
    for (int i = 0; i < LinearStep::rigid_states; ++i) visit(i);
    if (states_ == LinearStep::rigid_states) return;
    for (int i = LinearStep::rigid_states; i < state_count; ++i) visit(i);
  }
  void clear_states(Row& row) const {
    row.clear_first(LinearStep::rigid_states);
    if (states_ != LinearStep::rigid_states) row.clear_first(state_count);
  }

  /// Where a row is in the normal equations, which have a row for each state that a plant may have.
  int outward(int row) const { return row < states_ ? row : row - states_ + state_count; }

  PlantModel<Dual> model_of(const Measurement& run, const Plant& plant,
                            const std::vector<FreeParameter>& free) const {
    PlantModel<Dual> model = make_model_of_run<Dual>(plant, run);
    for (std::size_t j = 0; j < free.size(); ++j)
      model.parameters[effect_parameter_offset(free[j].effect) + free[j].index].v.set(
          states_ + static_cast<int>(j), 1.0);
    return model;
  }

  static std::array<Dual, 2> sensor_gains(const PlantModel<Dual>& model) {
    const SensorLine<Dual> line(model);
    return {line.cart_gain, line.theta_gain};
  }

  static PlantState<Dual> constant_state(const PlantState<double>& from) {
    PlantState<Dual> state;
    const auto values = as_array(state);
    const auto numbers = as_array(from);
    for (std::size_t i = 0; i < values.size(); ++i) *values[i] = Dual(*numbers[i]);
    return state;
  }

  const Dynamics<Dual>& dynamics() const { return simulator_.engine().dynamics(); }

  std::uint64_t steps_without_event() const {
    return simulator_.engine().step_count() - simulator_.engine().event_count();
  }

  std::array<const Dual*, state_count> reached_state() const { return as_array(simulator_.engine().state()); }

  void start_sensitivity(const PlantState<double>& start) {
    for (int i = 0; i < states_; ++i) sensitivity_[static_cast<std::size_t>(i)] = Row::unit(i);
    // Parameters of the sensors change what is meant by what they show at the start, not what they show.
    PlantState<Dual> at_start = constant_state(start);
    at_start.cart_m.v.set(0, 1.0);
    const Outputs<Dual> shown = dynamics().measure(at_start);
    Row by_parameters = shown.cart_m.v;
    by_parameters.set(0, 0.0);
    sensitivity_[0] -= by_parameters / shown.cart_m.v[0];
    sensitivity_[1] -= shown.theta_rad.v / sensors_[1].a;
    sensitivity_[2] -= start.cart_mps * worth_less_[0];
    sensitivity_[3] -= start.theta_radps * worth_less_[1];
  }

  /// The start of a mass on the cart depends on that of the cart, and on its own parameters.
  void start_attached_sensitivity(const Plant& plant, const PlantState<double>& start,
                                  const std::vector<FreeParameter>& free) {
    const MotionBefore motion(run_, segment_);
    if (!motion.is_known()) return;
    Row &place = sensitivity_[attached_state], &speed = sensitivity_[attached_state + 1];
    place = speed = Row{};
    if (motion.is_empty()) return;
    place -= sensitivity_[0];
    speed -= sensitivity_[2];
    const PlantState<double> at = motion.with_mass(plant, start);
    for (std::size_t j = 0; j < free.size(); ++j) {
      if (!attaches_mass(free[j].effect)) continue;
      constexpr double step_of_scale = 1e-5;
      const double step = step_of_scale * free[j].scale;
      PlantEffect further = *plant.find(free[j].effect);
      further.values[free[j].index] += step;
      Plant other = plant;
      other.set(free[j].effect, further.values);
      const PlantState<double> there = motion.with_mass(other, start);
      const int column = states_ + static_cast<int>(j);
      place.set(column, (there.attached_m - at.attached_m) / step);
      speed.set(column, (there.attached_mps - at.attached_mps) / step);
    }
  }

  /// Simulates to sample k, and fills what of its step does not depend on the filter.
  Outputs<Dual> simulate_to(std::size_t k, LinearStep& step) {
    const bool first = k == segment_.first;
    step.period_s = first ? 0.0 : run_.time_s[k] - run_.time_s[k - 1];
    if (first) {
      step.keeps = 0.0;
      for (auto& by : step.impulse) by[0] = by[1] = 0.0;
    }
    // Each sample starts with fresh unit derivatives.
    simulator_.engine().seed();
    const std::uint64_t steps_before = steps_without_event();
    if (!first) {
      command_from(k - 1, run_, simulator_);
      simulator_.advance_to(run_.time_s[k]);
    }
    const bool lost = is_lost(step.period_s, steps_without_event() - steps_before);
    const PlantState<Dual>& reached = simulator_.engine().state();
    const std::array<const Dual*, state_count> end = reached_state();
    std::fill_n(&step.transition[0][0], state_count * state_count, 0.0);
    for_each_state([&](int i) {
      if (first) {
        step.transition[i][i] = 1.0;
      } else {
        for_each_state([&](int j) { step.transition[i][j] = end[static_cast<std::size_t>(i)]->v[j]; });
      }
    });
    set_holds(step);
    const Outputs<Dual> outputs = simulator_.engine().outputs();
    const double simulated[2] = {value_of(outputs.cart_m), value_of(outputs.theta_rad)};
    for (int channel = 0; channel < 2; ++channel) {
      step.gain[channel] = value_of(sensors_[static_cast<std::size_t>(channel)]);
      step.weight[channel] = weight_of(run_, channel, k);
      step.residual[channel] =
          covariance_.present(channel) ? measured(run_, channel, k) - simulated[channel] : 0.0;
      if (lost) step.residual[channel] = std::numeric_limits<double>::infinity();
    }
    step.rate[0] = value_of(reached.cart_mps);
    step.rate[1] = value_of(reached.theta_radps);
    noise_input_.set(step, value_of(reached.theta_rad));
    return outputs;
  }

  /// Velocities that a unit of force and of torque give over a period that begins at a step. What dry
  /// friction holds they do not move: friction balances them.
  static double impulse_of(const LinearStep& from, int disturbance, int moved, double period_s) {
    if (from.holds[moved] > 0.0) return 0.0;
    return (disturbance == 0 ? from.by_force[moved] : from.by_torque[moved]) * period_s;
  }

  void set_impulse(LinearStep& step, const LinearStep& from) const {
    step.keeps = covariance_.disturbed() ? covariance_.keeps(step.period_s) : 0.0;
    for (int d = 0; d < LinearStep::disturbances; ++d)
      for (int i = 0; i < 2; ++i) step.impulse[d][i] = impulse_of(from, d, i, step.period_s);
  }

  /// Adds what the estimated disturbances give until the next sample to the correction of a step.
  void push_by_disturbances(double period_s, LinearStep& step) {
    if (!covariance_.disturbed()) return;
    for (int d = 0; d < LinearStep::disturbances; ++d)
      for (int i = 0; i < 2; ++i)
        step.correction[2 + i] +=
            impulse_of(step, d, i, period_s) * disturbance_[static_cast<std::size_t>(d)];
  }

  void set_holds(LinearStep& step) const {
    const EventEngine<Dual>& engine = simulator_.engine();
    step.holds[0] = step.holds[1] = 0.0;
    if (!run_.cart_locked && !dynamics().has_bristle_state() && engine.cart_at_rest())
      step.holds[0] = min_dry_level(dynamics(), engine.state());
    if (dynamics().has_pendulum() && engine.pivot_at_rest())
      step.holds[1] = value_of(dynamics().pivot_dry_level());
  }

  void carry_sensitivity(const LinearStep& step) {
    const std::array<const Dual*, state_count> end = reached_state();
    if (covariance_.disturbed()) {
      for (std::size_t d = 0; d < disturbance_sensitivity_.size(); ++d) {
        for (std::size_t i = 0; i < 2; ++i)
          if (step.impulse[d][i] != 0.0)
            sensitivity_[2 + i] += step.impulse[d][i] * disturbance_sensitivity_[d];
        disturbance_sensitivity_[d] *= step.keeps;
      }
    }
    const std::array<Row, state_count> former = sensitivity_;
    for_each_state([&](int i) {
      const auto at = static_cast<std::size_t>(i);
      Row moved = end[at]->v;
      clear_states(moved);
      for_each_state([&](int j) {
        if (step.transition[i][j] != 0.0)
          moved += step.transition[i][j] * former[static_cast<std::size_t>(j)];
      });
      sensitivity_[at] = moved;
    });
  }

  /// Updates the filter with each channel in turn. False for a value that is not finite.
  bool update(LinearStep& step, const Outputs<Dual>& outputs, NormalEquations* normal) {
    std::fill(step.correction, step.correction + state_count, 0.0);
    for (double& d : disturbance_) d *= step.keeps;
    for (int channel = 0; channel < 2; ++channel) {
      if (!covariance_.present(channel)) continue;
      covariance_.update(step, channel);
      step.variance[channel] = covariance_.variance();
      std::copy(covariance_.gain(), covariance_.gain() + state_count + LinearStep::disturbances,
                step.update[channel]);
      const double e = step.residual[channel] - step.gain[channel] * step.correction[channel];
      step.innovation[channel] = e;
      for (int i = 0; i < state_count; ++i) step.correction[i] += covariance_.gain()[i] * e;
      for (std::size_t d = 0; d < disturbance_.size(); ++d)
        disturbance_[d] += covariance_.gain()[state_count + d] * e;
      if (normal == nullptr) continue;
      if (!std::isfinite(e)) {
        normal->likelihood.chi_square = std::numeric_limits<double>::infinity();
        return false;
      }
      normal->likelihood.add(e, covariance_.variance(), step.weight[channel]);
      add_innovation(step, channel, outputs);
    }
    return true;
  }

  /// Adds an innovation to the normal equations, and corrects the sensitivities as the filter does the state.
  void add_innovation(const LinearStep& step, int channel, const Outputs<Dual>& outputs) {
    const PlantState<Dual>& reached = simulator_.engine().state();
    const double e = step.innovation[channel];
    // Of what the sensor shows, what is its own, and what comes with the state.
    Row row = channel == 0 ? outputs.cart_m.v : outputs.theta_rad.v;
    row -= step.gain[channel] * reached_state()[static_cast<std::size_t>(channel)]->v;
    if (channel == 0) row -= shown_of_speed_s_ * reached.cart_mps.v;
    clear_states(row);
    row += step.gain[channel] * sensitivity_[static_cast<std::size_t>(channel)];
    if (channel == 0) row += shown_of_speed_s_ * sensitivity_[2];
    const double weight = step.weight[channel] / covariance_.variance();
    add_square<N>(row, weight, columns_, information_);
    score_ += (weight * e) * row;
    for_each_state([&](int i) {
      if (covariance_.gain()[i] == 0.0) return;
      Row& of_state = sensitivity_[static_cast<std::size_t>(i)];
      of_state -= covariance_.gain()[i] * row;
      const std::size_t sensor = i == 1 || i == 3 ? 1 : 0;  // theta and omega; all others are of the cart
      of_state -= covariance_.gain()[i] * e * worth_less_[sensor];
    });
    if (!covariance_.disturbed()) return;
    for (std::size_t d = 0; d < disturbance_sensitivity_.size(); ++d)
      disturbance_sensitivity_[d] -= covariance_.gain()[state_count + d] * row;
  }

  const Measurement& run_;
  const Segment& segment_;
  int states_;  ///< that the plant has
  int columns_;
  Simulator<Dual> simulator_;
  std::array<Dual, 2> sensors_;
  std::array<Row, 2> worth_less_;
  double shown_of_speed_s_;
  NoiseInput noise_input_;
  EkfCovariance<double> covariance_;
  std::array<Row, state_count> sensitivity_;                    ///< of the state that the filter estimates
  std::array<double, LinearStep::disturbances> disturbance_{};  ///< estimated force and torque
  std::array<Row, LinearStep::disturbances> disturbance_sensitivity_{};
  std::array<Row, N> information_{};  ///< columns, of which the lower triangle counts
  Row score_;
};

}  // namespace

void linearise_segment(const FitData& data, std::size_t s, const FitPoint& point,
                       const std::vector<FreeParameter>& free, std::vector<LinearStep>& steps,
                       NormalEquations* normal) {
  const Segment& segment = data.segments[s];
  const auto with = [&]<int N>() {
    SegmentLineariser<N>((*data.runs)[segment.run], segment, point, point.starts[s], free).run(steps, normal);
  };
  const std::size_t slots = free.size() + static_cast<std::size_t>(estimated_states(point.plant));
  if (slots <= 8) return with.template operator()<8>();
  if (slots <= 16) return with.template operator()<16>();
  if (slots <= 24) return with.template operator()<24>();
  return with.template operator()<max_derivatives>();
}

}  // namespace upright
