#include "upright/estimation/fit.hpp"

#include <ceres/jet.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "base/parallel.hpp"
#include "upright/model/elementary.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {

namespace {

constexpr int states = LinearStep::states;
constexpr double infinity = std::numeric_limits<double>::infinity();

using StateMatrix = double[states][states];
using NormalMatrix = Eigen::MatrixXd;

/// Information on the initial state beyond the data: nearly none, enough to keep unmeasured states in place.
constexpr std::array<double, states> start_information = {1.0, 1.0, 0.1, 0.01, 1e4};

template <class S>
std::array<S*, states> as_array(PlantState<S>& s) {
  return {&s.cart_m, &s.theta_rad, &s.cart_mps, &s.theta_radps, &s.bristle_m};
}

EngineOptions engine_options() {
  EngineOptions options;
  options.max_step_s = 4e-3;
  options.step_fraction = 0.5;
  options.resolve_bristles = false;
  options.quick_derivatives = true;
  options.event_tolerance_s = 1e-9;
  return options;
}

/// Brings a simulator to the start of a segment with the commands that can still be acting there. Before the
/// record the motor had no voltage.
template <class S>
void start_segment(Simulator<S>& simulator, const Measurement& run, const Segment& segment,
                   PlantState<S> state) {
  const Dynamics<S>& dynamics = simulator.engine().dynamics();
  const double delay = value_of(dynamics.input_delay_s());
  const double start = run.time_s[segment.first];
  double history = delay;
  if (dynamics.has_motor_lag()) history += 12.0 * value_of(dynamics.motor_time_constant_s());
  std::size_t k = segment.first;
  while (k > 0 && run.time_s[k] >= start - history) --k;
  if (dynamics.has_motor_lag()) {
    // The lag is linear: follow it exactly over the part of the record that it still remembers.
    S lagged = dynamics.actuate(S(k == 0 ? 0.0 : run.voltage_v[k]));
    S acting = lagged;
    S now = S(run.time_s[k]);
    const auto relax = [&](const S& until) {
      lagged =
          acting + (lagged - acting) * elementary::exp(S(-(until - now) / dynamics.motor_time_constant_s()));
      now = until;
    };
    for (std::size_t j = k; j < segment.first; ++j) {
      const S acts = S(run.time_s[j]) + dynamics.input_delay_s();
      if (value_of(acts) >= start) break;
      relax(acts);
      acting = dynamics.actuate(S(run.voltage_v[j]));
    }
    relax(S(start));
    state.motor_v = lagged;
  }
  double acting_v = k == 0 ? 0.0 : run.voltage_v[k];
  std::size_t next = k;
  while (next < segment.first && run.time_s[next] + delay < start) acting_v = run.voltage_v[next++];
  simulator.start(state, start, acting_v);
  for (; next < segment.first; ++next) simulator.command(run.time_s[next], run.voltage_v[next]);
}

double measured(const Measurement& run, int channel, std::size_t k) {
  return channel == 0 ? run.cart_m[k] : run.theta_rad[k];
}

double weight_of(const Measurement& run, int channel, std::size_t k) {
  const std::vector<double>& weights = channel == 0 ? run.cart_weight : run.theta_weight;
  return weights.empty() ? 1.0 : weights[k];
}

bool has_channel(const Measurement& run, const Plant& plant, int channel) {
  return channel == 0 ? run.has_cart() : run.has_theta() && plant.pendulum.has_value();
}

/// Covariance, gains and innovation variances of the extended Kalman filter, whose innovations are white
/// under the right model.
class EkfCovariance {
 public:
  EkfCovariance(const Measurement& run, const Plant& plant, const Noise& noise)
      : noise_(noise),
        present_{has_channel(run, plant, 0), has_channel(run, plant, 1)},
        sensor_variance_{square(run.has_cart() ? run.cart_noise_m() : 1.0),
                         square(run.has_theta() ? run.theta_noise_rad() : 1.0)},
        bristles_(plant.find(bristle_effect()) != nullptr) {}

  /// Carries the covariance to the next sample.
  void predict(const LinearStep& step) {
    if (noise_.force == 0.0 && noise_.torque == 0.0) return;
    active_ = true;
    if (step.holds[0] > 0.0 || step.holds[1] > 0.0) {
      carry_creeping(step);
    } else {
      carry(step);
    }
  }

  bool present(int channel) const { return present_[channel]; }

  /// Updates with one channel: its gain and innovation variance. What is only a part of a measurement
  /// corrects by as much less.
  void update(const LinearStep& step, int channel) {
    const double c = step.gain[channel];
    const double sensor =
        square(noise_.sensors) * sensor_variance_[channel] + square(noise_.jitter_s * step.rate[channel]);
    variance_ = sensor;
    if (!active_) return;
    const double spread = c * c * p_[channel][channel];
    variance_ += spread;
    const double with_weight = sensor / step.weight[channel] + spread;
    bristles_ ? correct<states>(c, channel, with_weight) : correct<states - 1>(c, channel, with_weight);
  }

  double variance() const { return variance_; }
  const double* gain() const { return gain_; }

 private:
  static double square(double x) { return x * x; }

  static std::size_t bristle_effect() {
    static const std::size_t effect = effect_number("bristle_friction");
    return effect;
  }

  /// `Moving` states, the last one only with bristles. Inner loops run along rows, which SIMD likes.
  template <int Moving>
  void correct(double c, int channel, double variance) {
    double seen[Moving];
    for (int j = 0; j < Moving; ++j) seen[j] = c * p_[channel][j];
    for (int i = 0; i < Moving; ++i) gain_[i] = seen[i] / variance;
    for (int i = 0; i < Moving; ++i)
      for (int j = 0; j < Moving; ++j) p_[i][j] -= gain_[i] * seen[j];
  }

  void carry(const LinearStep& step) { bristles_ ? carry<states>(step) : carry<states - 1>(step); }

  template <int Moving>
  void carry(const LinearStep& step) {
    const double f = square(noise_.force) * step.period_s, t = square(noise_.torque) * step.period_s;
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j)
        p_[2 + i][2 + j] +=
            f * step.by_force[i] * step.by_force[j] + t * step.by_torque[i] * step.by_torque[j];
    // P goes to T P T', whose transpose it is too.
    double half[Moving][Moving] = {}, turned[Moving][Moving], carried[Moving][Moving] = {};
    for (int i = 0; i < Moving; ++i)
      for (int k = 0; k < Moving; ++k)
        for (int j = 0; j < Moving; ++j) half[i][j] += step.transition[i][k] * p_[k][j];
    for (int i = 0; i < Moving; ++i)
      for (int j = 0; j < Moving; ++j) turned[j][i] = half[i][j];
    for (int i = 0; i < Moving; ++i)
      for (int k = 0; k < Moving; ++k)
        for (int j = 0; j < Moving; ++j) carried[i][j] += step.transition[i][k] * turned[k][j];
    for (int i = 0; i < Moving; ++i)
      for (int j = 0; j < Moving; ++j) p_[i][j] = 0.5 * (carried[i][j] + carried[j][i]);
  }

  /// Dry friction under white force: a contact that rests in the model creeps at random in truth.
  struct Creep {
    double speed = 0.0;  ///< standard deviation; 0: it rests
    double keeps = 0.0;  ///< share of a speed that is left a sample later
    double moves_s = 0.0;
    double rate_variance = 0.0, covariance = 0.0, place_variance = 0.0;
  };

  /// Statistical linearisation: dv = -(F/m) sign(v) dt + (q/m) dW has a Laplace distribution of speeds, of
  /// standard deviation q^2 / (sqrt(2) F m); the linear process with it and the same noise forgets in q^2 /
  /// F^2.
  Creep creep_of(const LinearStep& step, int contact, double push) const {
    Creep creep;
    if (!(step.holds[contact] > 0.0) || push == 0.0) return creep;
    const double decay = step.holds[contact] * (contact == 0 ? step.by_force[0] : step.by_torque[1]);
    const double speed = square(push) / (std::numbers::sqrt2 * decay), forgets_s = square(push / decay);
    constexpr double shows = 0.01;  // of the sensor's noise in a sample: less is rest
    if (square(speed * std::min(forgets_s, step.period_s)) < square(shows) * sensor_variance_[contact])
      return creep;
    const double periods = step.period_s / forgets_s;
    creep.speed = speed;
    creep.keeps = std::exp(-periods);
    const double lost = -std::expm1(-periods);
    creep.moves_s = forgets_s * lost;
    creep.rate_variance = square(speed) * lost * (1.0 + creep.keeps);
    creep.covariance = square(speed) * forgets_s * square(lost);
    creep.place_variance =
        square(speed * forgets_s) * std::max(0.0, 2.0 * periods - lost * (3.0 - creep.keeps));
    return creep;
  }

  void carry_creeping(LinearStep step) {
    const Creep creep[2] = {creep_of(step, 0, step.by_force[0] * noise_.force),
                            creep_of(step, 1, step.by_torque[1] * noise_.torque)};
    for (int c = 0; c < 2; ++c) {
      if (creep[c].speed == 0.0) continue;
      step.transition[2 + c][2 + c] = creep[c].keeps;
      step.transition[c][2 + c] = creep[c].moves_s;
      step.by_force[c] = step.by_torque[c] = 0.0;
    }
    carry(step);
    for (int c = 0; c < 2; ++c) {
      p_[2 + c][2 + c] += creep[c].rate_variance;
      p_[c][2 + c] = p_[2 + c][c] += creep[c].covariance;
      p_[c][c] += creep[c].place_variance;
    }
  }

  Noise noise_;
  bool present_[2];
  double sensor_variance_[2];
  bool bristles_;
  bool active_ = false;
  StateMatrix p_{};
  double gain_[states] = {}, variance_ = 1.0;
};

struct Likelihood {
  double chi_square = 0.0;
  double log_variance = 0.0;
  double samples = 0.0;
  double objective() const { return chi_square + log_variance; }
};

/// Adds one innovation to a likelihood. A value that is not finite makes it infinite.
void count(Likelihood& sum, double e, double variance, double weight) {
  sum.chi_square += std::isfinite(e) ? weight * e * e / variance : infinity;
  sum.log_variance += weight * std::log(variance);
  sum.samples += weight;
}

/// Likelihood of a segment that is linearised, had the noise been another: to first order the filtered
/// trajectory moves by what the other gains would have corrected.
Likelihood likelihood_with_noise(const std::vector<LinearStep>& steps, const Measurement& run,
                                 const Plant& plant, const Noise& noise) {
  EkfCovariance covariance(run, plant, noise);
  Likelihood sum;
  double shift[states] = {}, moved[states];
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const LinearStep& step = steps[k];
    if (k > 0) {
      covariance.predict(step);
      for (int i = 0; i < states; ++i) {
        moved[i] = 0.0;
        for (int j = 0; j < states; ++j) moved[i] += step.transition[i][j] * shift[j];
      }
      std::copy(moved, moved + states, shift);
    }
    double update[states] = {}, former[states] = {};
    for (int channel = 0; channel < 2; ++channel) {
      if (!covariance.present(channel)) continue;
      covariance.update(step, channel);
      const double c = step.gain[channel];
      const double e = step.residual[channel] - c * (shift[channel] + update[channel]);
      const double e_former = step.residual[channel] - c * former[channel];
      count(sum, e, covariance.variance(), step.weight[channel]);
      for (int i = 0; i < states; ++i) {
        update[i] += covariance.gain()[i] * e;
        former[i] += step.update[channel][i] * e_former;
      }
    }
    for (int i = 0; i < states; ++i) shift[i] += update[i] - former[i];
  }
  return sum;
}

/// Normal equations of one segment: initial state (first) and parameters, whitened.
struct Normal {
  NormalMatrix h;
  Eigen::VectorXd g;
  Likelihood likelihood;
  std::vector<double> blocks;  ///< its objective, a stretch of time at a time
};

/// Adds a filter's correction to the state of an engine.
template <class S>
void correct_state(EventEngine<S>& engine, const double (&update)[states]) {
  if (std::all_of(update, update + states, [](double u) { return u == 0.0; })) return;
  PlantState<S> state = engine.state();
  const auto values = as_array(state);
  for (int i = 0; i < states; ++i) *values[static_cast<std::size_t>(i)] += S(update[i]);
  engine.correct(state);
}

/// At which a cart at rest begins to slide, in the direction in which it does so sooner.
template <class S>
double least_dry_level(const Dynamics<S>& dynamics, const S& cart_m) {
  return std::min(value_of(dynamics.cart_dry_level(cart_m, S(0.0), S(1.0))),
                  value_of(dynamics.cart_dry_level(cart_m, S(0.0), S(-1.0))));
}

/// Adds weight * row * row', of which the lower triangle counts, in blocks that SIMD likes.
template <int N>
void add_square(const Eigen::Matrix<double, N, 1>& row, double weight, int columns,
                Eigen::Matrix<double, N, N>& sum) {
  constexpr int width = 4;
  const auto add_block = [&]<int First>(std::integral_constant<int, First>) {
    if (First >= columns) return;
    const auto below = row.template tail<N - First>();
    for (int j = First; j < First + width; ++j)
      sum.template block<N - First, 1>(First, j) += (weight * row[j]) * below;
  };
  [&]<int... Block>(std::integer_sequence<int, Block...>) {
    (add_block(std::integral_constant<int, Block * width>{}), ...);
  }
  (std::make_integer_sequence<int, N / width>{});
}

/// What the sensors, which are linear, show of a unit of cart and pendulum.
template <class S>
std::array<S, 2> sensor_gains(const Dynamics<S>& dynamics) {
  PlantState<S> unit;
  unit.cart_m = unit.theta_rad = S(1.0);
  const Outputs<S> at_0 = dynamics.measure(PlantState<S>{}), at_1 = dynamics.measure(unit);
  return {at_1.cart_m - at_0.cart_m, at_1.theta_rad - at_0.theta_rad};
}

/// What the cart's sensor shows of a unit of its speed: through back-EMF a drive that gives way is set back.
/// Too little to count in a filter's gain, but derivatives are of all that is shown.
template <class S>
double shown_of_cart_speed_s(const Dynamics<S>& dynamics) {
  PlantState<S> unit;
  unit.cart_mps = S(1.0);
  return value_of(dynamics.measure(unit).cart_m) - value_of(dynamics.measure(PlantState<S>{}).cart_m);
}

/// Follows a segment with dual numbers, a sample at a time; chains the derivatives and whitens them on the
/// way.
template <int N>
void linearise_segment(const Measurement& run, const Segment& segment, const EngineOptions& engine,
                       const FitPoint& point, const PlantState<double>& start,
                       const std::vector<FreeParameter>& free, bool with_normal,
                       std::vector<LinearStep>& steps, Normal& normal) {
  using Jet = ceres::Jet<double, N>;
  const int parameters = static_cast<int>(free.size());
  const int columns = states + parameters;
  PlantModel<Jet> model = make_model<Jet>(point.plant, run.cart_locked);
  for (int j = 0; j < parameters; ++j)
    model
        .parameters[effect_parameter_offset(free[static_cast<std::size_t>(j)].effect) +
                    free[static_cast<std::size_t>(j)].index]
        .v[states + j] = 1.0;
  Simulator<Jet> simulator(model, engine, 64 + segment.last - segment.first);
  PlantState<Jet> state;
  {
    PlantState<double> plain = start;
    const auto from = as_array(plain);
    const auto to = as_array(state);
    for (int i = 0; i < states; ++i)
      *to[static_cast<std::size_t>(i)] = Jet(*from[static_cast<std::size_t>(i)]);
  }
  start_segment(simulator, run, segment, state);
  const Dynamics<Jet>& dynamics = simulator.engine().dynamics();
  // Noise is pushed through the plant file's own masses: were they the fitted ones, the fit could shrink its
  // noise by making the plant heavier.
  const std::optional<Pendulum>& pendulum = point.plant.pendulum;
  const double total_mass = point.plant.cart_mass_kg + (pendulum ? pendulum->mass_kg : 0.0);
  const double coupling = pendulum ? pendulum->mass_kg * pendulum->length_to_com_m : 0.0;
  const double inertia = pendulum ? pendulum->inertia_about_pivot_kgm2() : 1.0;
  const bool bristles = dynamics.has_bristle_state();
  const std::array<Jet, 2> sensors = sensor_gains(dynamics);
  // A correction is in the sensors' units: to a state it is worth as much less as they show more of it.
  std::array<Eigen::Matrix<double, N, 1>, 2> worth_less;
  for (std::size_t channel = 0; channel < 2; ++channel)
    worth_less[channel] = sensors[channel].v / sensors[channel].a;
  const double shown_of_speed_s = shown_of_cart_speed_s(dynamics);

  // As in the dual numbers: initial state first, then parameters, then nothing.
  using Row = Eigen::Matrix<double, N, 1>;
  std::array<Row, states> sensitivity, former;
  for (int i = 0; i < states; ++i) sensitivity[static_cast<std::size_t>(i)] = Row::Unit(i);
  {
    // Parameters of the sensors change what is meant by what they show at the start, not what they show.
    const PlantState<Jet> from{Jet(start.cart_m), Jet(start.theta_rad), Jet(start.cart_mps),
                               Jet(start.theta_radps)};
    const Outputs<Jet> shown = dynamics.measure(from);
    sensitivity[0] -= shown.cart_m.v / sensors[0].a;
    sensitivity[1] -= shown.theta_rad.v / sensors[1].a;
    sensitivity[2] -= start.cart_mps * worth_less[0];
    sensitivity[3] -= start.theta_radps * worth_less[1];
  }
  Eigen::Matrix<double, N, N> information = Eigen::Matrix<double, N, N>::Zero();
  Row score = Row::Zero();
  EkfCovariance covariance(run, point.plant, point.noise);
  steps.resize(segment.last - segment.first + 1);
  if (with_normal) {
    normal.h.setZero(columns, columns);
    normal.g.setZero(columns);
    normal.likelihood = {};
    normal.blocks.clear();
  }
  constexpr double block_s = 0.25;
  double block_end_s = -infinity, counted = 0.0;

  for (std::size_t k = segment.first; k <= segment.last; ++k) {
    LinearStep& step = steps[k - segment.first];
    const bool first = k == segment.first;
    step.period_s = first ? 0.0 : run.time_s[k] - run.time_s[k - 1];
    // Each sample starts with fresh unit derivatives.
    simulator.engine().seed();
    if (!first) {
      simulator.command(run.time_s[k - 1], run.voltage_v[k - 1]);
      simulator.advance_to(run.time_s[k]);
    }
    const PlantState<Jet>& reached = simulator.engine().state();
    step.holds[0] = step.holds[1] = 0.0;
    if (!run.cart_locked && !bristles && simulator.engine().cart_at_rest())
      step.holds[0] = least_dry_level(dynamics, reached.cart_m);
    if (dynamics.has_pendulum() && simulator.engine().pivot_at_rest())
      step.holds[1] = value_of(dynamics.pivot_dry_level());
    const std::array<const Jet*, states> end = {&reached.cart_m, &reached.theta_rad, &reached.cart_mps,
                                                &reached.theta_radps, &reached.bristle_m};
    for (int i = 0; i < states; ++i)
      for (int j = 0; j < states; ++j)
        step.transition[i][j] = first ? (i == j ? 1.0 : 0.0) : end[static_cast<std::size_t>(i)]->v[j];
    const Outputs<Jet> outputs = simulator.engine().outputs();
    const double simulated[2] = {value_of(outputs.cart_m), value_of(outputs.theta_rad)};
    for (int channel = 0; channel < 2; ++channel) {
      step.gain[channel] = value_of(sensors[static_cast<std::size_t>(channel)]);
      step.weight[channel] = weight_of(run, channel, k);
      step.residual[channel] =
          covariance.present(channel) ? measured(run, channel, k) - simulated[channel] : 0.0;
    }
    step.rate[0] = value_of(reached.cart_mps);
    step.rate[1] = value_of(reached.theta_radps);
    const double off = coupling * std::cos(value_of(reached.theta_rad));
    if (run.cart_locked) {
      step.by_force[0] = step.by_force[1] = step.by_torque[0] = 0.0;
      step.by_torque[1] = 1.0 / inertia;
    } else if (!dynamics.has_pendulum()) {
      step.by_force[0] = 1.0 / total_mass;
      step.by_force[1] = step.by_torque[0] = step.by_torque[1] = 0.0;
    } else {
      const double determinant = total_mass * inertia - off * off;
      step.by_force[0] = inertia / determinant;
      step.by_force[1] = step.by_torque[0] = -off / determinant;
      step.by_torque[1] = total_mass / determinant;
    }
    if (!first) {
      covariance.predict(step);
      if (with_normal) {
        former = sensitivity;
        for (std::size_t i = 0; i < states; ++i) {
          Row moved = end[i]->v;
          moved.template head<states>().setZero();
          for (std::size_t j = 0; j < states; ++j)
            if (step.transition[i][j] != 0.0) moved += step.transition[i][j] * former[j];
          sensitivity[i] = moved;
        }
      }
    }
    double update[states] = {};
    for (int channel = 0; channel < 2; ++channel) {
      if (!covariance.present(channel)) continue;
      covariance.update(step, channel);
      step.variance[channel] = covariance.variance();
      std::copy(covariance.gain(), covariance.gain() + states, step.update[channel]);
      const double e = step.residual[channel] - step.gain[channel] * update[channel];
      for (int i = 0; i < states; ++i) update[i] += covariance.gain()[i] * e;
      if (!with_normal) continue;
      count(normal.likelihood, e, covariance.variance(), step.weight[channel]);
      if (!std::isfinite(e)) return;
      // Of what the sensor shows, what is its own, and what comes with the state.
      Row row = channel == 0 ? outputs.cart_m.v : outputs.theta_rad.v;
      row -= step.gain[channel] * end[static_cast<std::size_t>(channel)]->v;
      if (channel == 0) row -= shown_of_speed_s * reached.cart_mps.v;
      row.template head<states>().setZero();
      row += step.gain[channel] * sensitivity[static_cast<std::size_t>(channel)];
      if (channel == 0) row += shown_of_speed_s * sensitivity[2];
      const double weight = step.weight[channel] / covariance.variance();
      add_square(row, weight, columns, information);
      score += (weight * e) * row;
      for (std::size_t i = 0; i < states; ++i) {
        if (covariance.gain()[i] == 0.0) continue;
        sensitivity[i] -= covariance.gain()[i] * row;
        const std::size_t sensor = i % 2 == 0 ? 0 : 1;  // x, v and the bristles; theta and omega
        sensitivity[i] -= covariance.gain()[i] * e * worth_less[sensor];
      }
    }
    correct_state(simulator.engine(), update);
    if (!with_normal) continue;
    if (run.time_s[k] >= block_end_s) {
      normal.blocks.push_back(0.0);
      block_end_s = run.time_s[k] + block_s;
    }
    normal.blocks.back() += normal.likelihood.objective() - counted;
    counted = normal.likelihood.objective();
  }
  if (!with_normal) return;
  const Eigen::Matrix<double, N, N> whole = information.template selfadjointView<Eigen::Lower>();
  normal.h = whole.topLeftCorner(columns, columns);
  normal.g = score.head(columns);
}

template <class Work>
void with_jet_size(std::size_t parameters, Work&& work) {
  const std::size_t slots = parameters + states;
  if (slots <= 8) return work.template operator()<8>();
  if (slots <= 16) return work.template operator()<16>();
  if (slots <= 24) return work.template operator()<24>();
  return work.template operator()<32>();
}

/// Inverse of an information matrix. What holds no information at all is left out (zeros); combinations of
/// the others that hold none are as good as unknown.
NormalMatrix inverse_of(const NormalMatrix& h) {
  const Eigen::VectorXd scale =
      h.diagonal().unaryExpr([](double v) { return v > 1e-200 ? 1.0 / std::sqrt(v) : 0.0; });
  const Eigen::SelfAdjointEigenSolver<NormalMatrix> solver(scale.asDiagonal() * h * scale.asDiagonal());
  constexpr double least = 1e-13;
  const Eigen::VectorXd inverse = solver.eigenvalues().cwiseMax(least).cwiseInverse();
  return scale.asDiagonal() * solver.eigenvectors() * inverse.asDiagonal() *
         solver.eigenvectors().transpose() * scale.asDiagonal();
}

/// The scatter of the scores over segments, but in no direction less than the likelihood itself says: noise
/// that is whiter than it looks must not shrink an interval.
NormalMatrix robust_spread(const NormalMatrix& information, const NormalMatrix& spread) {
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::VectorXd unscale = scale.cwiseInverse();
  NormalMatrix unit = unscale.asDiagonal() * information * unscale.asDiagonal();
  unit.diagonal().array() += 1e-12;
  const Eigen::LLT<NormalMatrix> root(unit);
  if (root.info() != Eigen::Success) return information;
  NormalMatrix relative =
      root.matrixL().solve(NormalMatrix(unscale.asDiagonal() * spread * unscale.asDiagonal()));
  relative = root.matrixL().solve(NormalMatrix(relative.transpose()));
  const Eigen::SelfAdjointEigenSolver<NormalMatrix> solver(0.5 * (relative + relative.transpose()));
  const Eigen::VectorXd raised = solver.eigenvalues().cwiseMax(1.0);
  const NormalMatrix half = scale.asDiagonal() * NormalMatrix(root.matrixL()) * solver.eigenvectors();
  return half * raised.asDiagonal() * half.transpose();
}

class Fitter {
 public:
  Fitter(const FitData& data, const FitPoint& start, const std::vector<FreeParameter>& free,
         const FitOptions& options)
      : data_(data), free_(free), options_(options), point_(start) {
    for (auto* steps : {&steps_, &former_steps_}) steps->resize(data.segments.size());
    for (auto* normals : {&normals_, &former_normals_}) normals->resize(data.segments.size());
    order_.resize(data.segments.size());
    std::iota(order_.begin(), order_.end(), std::size_t{0});
  }

  FitResult run() {
    FitResult result;
    double objective = evaluate();
    if (options_.or_noise && noise_objective(*options_.or_noise) < noise_objective(point_.noise)) {
      point_.noise = *options_.or_noise;
      objective = evaluate();
    }
    if (options_.noise_rounds == 0) descend(objective);
    if (options_.noise_last && std::isfinite(objective)) {
      estimate_noise({4.0, 1.5, 1.15});
      objective = evaluate();
    }
    for (int round = 0; round < options_.noise_rounds && std::isfinite(objective) && may_go_on(); ++round) {
      const double before = objective;
      constexpr double settled = 2.0, no_matter = 0.5;
      const Noise former = point_.noise;
      // What was estimated before is near.
      const double gain = estimate_noise(round == 0 ? std::vector<double>{10.0, 2.0, 1.2, 1.04, 1.01}
                                                    : std::vector<double>{1.2, 1.04, 1.01});
      if (round > 0 && converged_ && gain < no_matter) {
        point_.noise = former;
        break;
      }
      objective = evaluate();
      descend(objective);
      if (round > 0 && before - objective < settled) break;
    }
    result.converged = converged_;
    result.work_samples = work_samples_;
    finish(result);
    return result;
  }

 private:
  const Measurement& run_of(std::size_t s) const { return (*data_.runs)[data_.segments[s].run]; }

  void linearise(std::size_t s) {
    with_jet_size(free_.size(), [&]<int N>() {
      linearise_segment<N>(run_of(s), data_.segments[s], engine_options(), point_, point_.starts[s], free_,
                           true, steps_[s], normals_[s]);
    });
  }

  bool may_go_on() const { return data_.bound == nullptr || !data_.bound->is_reached_with(work_samples_); }

  /// All samples once, whether or not all were looked at: which are may depend on the number of cores.
  void count_work() {
    for (const Segment& s : data_.segments) work_samples_ += static_cast<double>(s.last - s.first + 1);
  }

  /// Linearises at the present point; its objective.
  double evaluate() {
    count_work();
    parallel_for(order_.size(), [&](std::size_t i) { linearise(order_[i]); });
    return likelihood_of_normals() + prior_objective();
  }

  /// The same after a step. Infinity where one segment, in which the cart sticks or slides for all the others
  /// say, is further off than the others can make up for: the rest are not looked at, and it is looked at
  /// first from then on.
  double evaluate_step(double promised_fall) {
    constexpr double out_of_reach = 3.0;
    count_work();
    const std::size_t none = order_.size();
    std::atomic<std::size_t> rejecting_segment = none;
    parallel_for(order_.size(), [&](std::size_t i) {
      if (rejecting_segment != none) return;
      const std::size_t s = order_[i];
      linearise(s);
      const double rise = normals_[s].likelihood.objective() - former_normals_[s].likelihood.objective();
      if (!(rise < out_of_reach * promised_fall)) rejecting_segment = i;
    });
    if (rejecting_segment == none) return likelihood_of_normals() + prior_objective();
    const auto place = order_.begin() + static_cast<std::ptrdiff_t>(rejecting_segment.load());
    std::rotate(order_.begin(), place, std::next(place));
    return infinity;
  }

  double likelihood_of_normals() const {
    double sum = 0.0;
    for (const Normal& normal : normals_) sum += normal.likelihood.objective();
    return sum;
  }

  double sample_count() const {
    double count = 0.0;
    for (const Normal& normal : normals_) count += normal.likelihood.samples;
    return count;
  }

  /// Gauss-Newton with damping. A step counts only if the whole objective falls, weights and log variances
  /// included.
  void descend(double& objective) {
    double damping = least_damping;
    converged_ = false;
    for (int iteration = 0; iteration < options_.most_iterations && std::isfinite(objective) && may_go_on();
         ++iteration) {
      const FitPoint former = point_;
      double next_objective = infinity;
      const double least_fall = options_.tolerance * sample_count() * 0.1 + 0.02;
      double rejected = infinity;
      for (int attempt = 0; attempt < 4; ++attempt) {
        Step next = step(damping);
        if (next.promised_fall < least_fall && attempt == 0) next = step(damping = hardly_damped);
        const bool promises = next.promised_fall >= least_fall;
        if (!promises && !next.cut_short) break;
        // A step that hardly differs from one that was rejected is not worth looking at, nor is one that does
        // not even promise to fall.
        constexpr double alike = 0.9;
        if (promises && next.promised_fall < alike * rejected) {
          point_ = std::move(next.point);
          swap_with_former();
          next_objective = evaluate_step(std::max(next.promised_fall, least_fall));
          if (next_objective < objective) break;
          point_ = former;
          swap_with_former();
          rejected = next.promised_fall;
        }
        damping = std::max(damping, least_damping) * 30.0;
      }
      if (!(next_objective < objective)) {
        converged_ = true;
        break;
      }
      // Where a step had to be damped, the next one has to be too.
      if (!std::isfinite(rejected)) damping = std::max(damping * 0.1, hardly_damped);
      const double fall = objective - next_objective;
      objective = next_objective;
      if (fall < least_fall) {
        converged_ = true;
        break;
      }
    }
  }

  void swap_with_former() {
    steps_.swap(former_steps_);
    normals_.swap(former_normals_);
  }

  /// How far the parameters are from where they are believed to be.
  Eigen::VectorXd off_belief() const {
    Eigen::VectorXd off(static_cast<Eigen::Index>(free_.size()));
    for (std::size_t j = 0; j < free_.size(); ++j) {
      const auto at = static_cast<Eigen::Index>(j);
      const double mean = options_.belief ? options_.belief->mean[at] : free_[j].prior_mean;
      off[at] = point_.plant.find(free_[j].effect)->values[free_[j].index] - mean;
    }
    return off;
  }

  NormalMatrix prior_information() const {
    if (options_.belief) return options_.belief->information;
    const auto np = static_cast<Eigen::Index>(free_.size());
    NormalMatrix information = NormalMatrix::Zero(np, np);
    for (Eigen::Index j = 0; j < np; ++j) {
      const double sigma = free_[static_cast<std::size_t>(j)].prior_sigma;
      if (sigma > 0.0) information(j, j) = 1.0 / (sigma * sigma);
    }
    return information;
  }

  double prior_objective() const {
    if (free_.empty()) return 0.0;
    const Eigen::VectorXd off = off_belief();
    return off.dot(prior_information() * off);
  }

  static constexpr double least_damping = 1e-4;  ///< of a first step
  /// Parameters that are one force are told apart by what is believed of them alone: next to nothing beside
  /// what is known of each by itself, and damping goes by that.
  static constexpr double hardly_damped = 1e-9;

  struct Step {
    FitPoint point;
    double promised_fall = 0.0;  ///< of the objective, were the residuals linear
    bool cut_short = false;      ///< at a bound, or for its length
  };

  /// The Gauss-Newton step of all segments: parameters first (initial states eliminated), then each initial
  /// state.
  Step step(double damping) const {
    const auto np = static_cast<Eigen::Index>(free_.size());
    const NormalMatrix prior = prior_information();
    const Eigen::VectorXd to_belief = -prior * off_belief();
    NormalMatrix h = prior;
    Eigen::VectorXd g = to_belief;
    std::vector<Eigen::Matrix<double, states, Eigen::Dynamic>> back(normals_.size());
    std::vector<Eigen::Matrix<double, states, 1>> base(normals_.size());
    for (std::size_t s = 0; s < normals_.size(); ++s) {
      const Normal& n = normals_[s];
      Eigen::Matrix<double, states, states> hii = n.h.topLeftCorner<states, states>();
      for (int i = 0; i < states; ++i)
        hii(i, i) += start_information[static_cast<std::size_t>(i)] + damping * hii(i, i);
      const Eigen::LDLT<Eigen::Matrix<double, states, states>> solver(hii);
      back[s] = solver.solve(n.h.topRightCorner(states, np));
      base[s] = solver.solve(n.g.head<states>());
      h += n.h.bottomRightCorner(np, np) - n.h.bottomLeftCorner(np, states) * back[s];
      g += n.g.tail(np) - n.h.bottomLeftCorner(np, states) * base[s];
    }
    Step result{point_};
    FitPoint& trial = result.point;
    Eigen::VectorXd delta = bounded_step(h, g, damping, result.cut_short);
    for (Eigen::Index j = 0; j < np; ++j) {
      const FreeParameter& p = free_[static_cast<std::size_t>(j)];
      PlantEffect effect = *trial.plant.find(p.effect);
      const double wanted = effect.values[p.index] + delta[j], moved = std::clamp(wanted, p.low, p.high);
      result.cut_short = result.cut_short || moved != wanted;
      delta[j] = moved - effect.values[p.index];
      effect.values[p.index] = moved;
      trial.plant.set(p.effect, effect.values);
    }
    const auto promise = [](const NormalMatrix& information, const Eigen::VectorXd& slope,
                            const Eigen::VectorXd& way) {
      return 2.0 * slope.dot(way) - way.dot(information * way);
    };
    result.promised_fall = promise(prior, to_belief, delta);
    follow_sensors(trial.starts, point_.plant, trial.plant);
    Eigen::VectorXd way(states + np);
    way.tail(np) = delta;
    for (std::size_t s = 0; s < normals_.size(); ++s) {
      const auto values = as_array(trial.starts[s]);
      constexpr std::array<double, states> longest = {0.01, 0.3, 0.5, 3.0, 0.01};
      way.head(states) = base[s] - back[s] * delta;
      for (int i = 0; i < states; ++i) {
        const double limit = longest[static_cast<std::size_t>(i)];
        result.cut_short = result.cut_short || std::abs(way[i]) > limit;
        way[i] = std::clamp(way[i], -limit, limit);
        *values[static_cast<std::size_t>(i)] += way[i];
      }
      result.promised_fall += promise(normals_[s].h, normals_[s].g, way);
    }
    return result;
  }

  /// Solves for the parameters; those held at a bound by the data stay there, and no step is longer than
  /// makes sense.
  Eigen::VectorXd bounded_step(const NormalMatrix& h, const Eigen::VectorXd& g, double damping,
                               bool& cut_short) const {
    const Eigen::Index np = g.size();
    std::vector<bool> held(static_cast<std::size_t>(np), false);
    Eigen::VectorXd delta = Eigen::VectorXd::Zero(np);
    for (int pass = 0; pass < 3; ++pass) {
      std::vector<Eigen::Index> moving;
      for (Eigen::Index j = 0; j < np; ++j)
        if (!held[static_cast<std::size_t>(j)]) moving.push_back(j);
      const auto n = static_cast<Eigen::Index>(moving.size());
      if (n == 0) break;
      NormalMatrix small(n, n);
      Eigen::VectorXd right(n);
      for (Eigen::Index a = 0; a < n; ++a) {
        const double sa = free_[static_cast<std::size_t>(moving[static_cast<std::size_t>(a)])].scale;
        right[a] = g[moving[static_cast<std::size_t>(a)]] * sa;
        for (Eigen::Index b = 0; b < n; ++b)
          small(a, b) = h(moving[static_cast<std::size_t>(a)], moving[static_cast<std::size_t>(b)]) * sa *
                        free_[static_cast<std::size_t>(moving[static_cast<std::size_t>(b)])].scale;
      }
      for (Eigen::Index a = 0; a < n; ++a) small(a, a) += damping * small(a, a) + 1e-6;
      const Eigen::VectorXd solved = small.ldlt().solve(right);
      delta.setZero();
      bool again = false;
      for (Eigen::Index a = 0; a < n; ++a) {
        const Eigen::Index j = moving[static_cast<std::size_t>(a)];
        const FreeParameter& p = free_[static_cast<std::size_t>(j)];
        const double value = point_.plant.find(p.effect)->values[p.index];
        const double limit = longest_step(p, value);
        const double wanted = std::isfinite(solved[a]) ? solved[a] * p.scale : 0.0;
        delta[j] = std::clamp(wanted, -limit, limit);
        cut_short = cut_short || delta[j] != wanted;
        const bool below = value <= p.low && delta[j] < 0.0;
        const bool above = value >= p.high && delta[j] > 0.0;
        if (below || above) {
          held[static_cast<std::size_t>(j)] = true;
          again = true;
        }
      }
      if (!again) break;
    }
    return delta;
  }

  /// Sizes enter nearly linearly and may go far at once; shapes, places and times may not.
  static double longest_step(const FreeParameter& p, double value) {
    const bool size = effect_registry()[p.effect].parameters[p.index].neutral == 0.0;
    return size ? std::max(std::abs(value), 4.0 * p.scale) : 0.5 * std::max(std::abs(value), p.scale);
  }

  double noise_objective(const Noise& noise) const {
    std::vector<double> parts(data_.segments.size());
    parallel_for(data_.segments.size(), [&](std::size_t s) {
      parts[s] = likelihood_with_noise(steps_[s], run_of(s), point_.plant, noise).objective();
    });
    double sum = 0.0;
    for (const double part : parts) sum += part;
    return sum;
  }

  /// One number of the noise, of which the likelihood's maximum is sought.
  struct NoiseParameter {
    double Noise::*value;
    double smallest, largest;  ///< below the smallest it is `least`
    double least;
    bool used;
    int tried_at = -1;  ///< after so many changes of the noise neither way was better
    bool off = false;   ///< nothing, and better so then: the step from there is the same whatever the factor

    double moved(double now, double move) const {
      const double to = now == 0.0 ? (move > 1.0 ? smallest * 10.0 : 0.0) : now * move;
      return to < smallest ? least : std::min(to, largest);
    }
  };

  /// Moves a parameter of the noise one way for as long as the objective falls; returns how often it did.
  int line_search(NoiseParameter& parameter, double move, double& objective) {
    constexpr double falls = 1e-3;
    for (int moves = 0;; ++moves) {
      Noise next = point_.noise;
      const double now = next.*parameter.value;
      next.*parameter.value = parameter.moved(now, move);
      if (next.*parameter.value == now) return moves;
      const double reached = noise_objective(next);
      if (!(reached < objective - falls)) {
        parameter.off = now == 0.0;
        return moves;
      }
      objective = reached;
      point_.noise = next;
    }
  }

  /// Maximum likelihood of the noise by a pattern search over decades, finer and finer. By how much it brings
  /// the objective down.
  double estimate_noise(const std::vector<double>& factors) {
    bool cart = false, pendulum = false;
    for (const Measurement& run : *data_.runs) {
      cart = cart || run.has_cart();
      pendulum = pendulum || (run.has_theta() && point_.plant.pendulum);
    }
    std::array<NoiseParameter, 4> parameters = {NoiseParameter{&Noise::force, 1e-5, 10.0, 0.0, cart},
                                                NoiseParameter{&Noise::torque, 1e-7, 1.0, 0.0, pendulum},
                                                NoiseParameter{&Noise::jitter_s, 1e-6, 1e-2, 0.0, true},
                                                NoiseParameter{&Noise::sensors, 1.0, 1e3, 1.0, true}};
    const double before = noise_objective(point_.noise);
    double objective = before;
    int changes = 0;
    for (const double factor : factors) {
      for (NoiseParameter& parameter : parameters)
        if (!parameter.off) parameter.tried_at = -1;
      int so_far = -1;
      for (int sweep = 0; sweep < 3 && changes != so_far; ++sweep) {
        so_far = changes;
        for (NoiseParameter& parameter : parameters) {
          if (!parameter.used || parameter.tried_at == changes) continue;
          int moves = line_search(parameter, factor, objective);
          if (moves == 0) moves = line_search(parameter, 1.0 / factor, objective);
          parameter.tried_at = changes += moves;
        }
      }
    }
    return before - objective;
  }

  /// The information without what stands at a bound: that is not estimated but held there, and lends the
  /// others no doubt.
  NormalMatrix without_held(NormalMatrix h) const {
    for (std::size_t j = 0; j < free_.size(); ++j) {
      const FreeParameter& p = free_[j];
      const double value = point_.plant.find(p.effect)->values[p.index];
      if (value > p.low && value < p.high) continue;
      const auto at = static_cast<Eigen::Index>(j);
      h.row(at).setZero();
      h.col(at).setZero();
    }
    return h;
  }

  void finish(FitResult& result) const {
    result.point = point_;
    result.objective = prior_objective();
    const auto np = static_cast<Eigen::Index>(free_.size());
    const NormalMatrix prior = prior_information();
    NormalMatrix h = prior, spread = NormalMatrix::Zero(np, np);
    for (const Normal& n : normals_) {
      result.segment_objective.push_back(n.likelihood.objective());
      result.block_objective.insert(result.block_objective.end(), n.blocks.begin(), n.blocks.end());
      result.segment_chi_square.push_back(n.likelihood.chi_square);
      result.segment_samples.push_back(n.likelihood.samples);
      result.objective += n.likelihood.objective();
      if (np == 0) continue;
      NormalMatrix hii = n.h.topLeftCorner(states, states);
      for (int i = 0; i < states; ++i) hii(i, i) += start_information[static_cast<std::size_t>(i)];
      const Eigen::LDLT<NormalMatrix> solver(hii);
      const NormalMatrix back = solver.solve(n.h.topRightCorner(states, np));
      h += n.h.bottomRightCorner(np, np) - n.h.bottomLeftCorner(np, states) * back;
      const Eigen::VectorXd score = n.g.tail(np) - back.transpose() * n.g.head(states);
      spread += score * score.transpose();
    }
    if (!std::isfinite(result.objective)) result.objective = infinity;
    result.information = h;
    if (np == 0) return;
    const NormalMatrix inverse = inverse_of(without_held(h));
    const auto segments = static_cast<double>(normals_.size());
    const double small_sample = segments > np + 1.0 ? segments / (segments - 1.0) : 2.0;
    result.covariance = inverse * (robust_spread(h - prior, spread * small_sample) + prior) * inverse;
    if (!std::isfinite(result.objective)) return;
    const Step further = step(hardly_damped);
    result.bounded_fall = further.promised_fall;
    if (!further.cut_short) result.promised_fall = further.promised_fall;
  }

  const FitData& data_;
  std::vector<FreeParameter> free_;
  FitOptions options_;
  FitPoint point_;
  std::vector<std::vector<LinearStep>> steps_, former_steps_;
  std::vector<Normal> normals_, former_normals_;
  std::vector<std::size_t> order_;  ///< in which segments are looked at; no result depends on it
  bool converged_ = false;
  double work_samples_ = 0.0;
};

/// Least squares of a parabola over samples around k: value and slope there.
std::pair<double, double> local_fit(const std::vector<double>& t, const std::vector<double>& y, std::size_t k,
                                    std::size_t first, std::size_t last, double width_s) {
  std::size_t a = k, b = k;
  while (a > first && t[k] - t[a - 1] <= width_s) --a;
  while (b < last && t[b + 1] - t[k] <= width_s) ++b;
  while (b - a < 4 && (a > first || b < last)) {
    if (a > first) --a;
    if (b < last) ++b;
  }
  Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  bool constant = true;
  for (std::size_t i = a; i <= b; ++i) {
    const double u = (t[i] - t[k]) / width_s;
    const Eigen::Vector3d basis(1.0, u, u * u);
    h += basis * basis.transpose();
    g += basis * (y[i] - y[k]);
    constant = constant && y[i] == y[k];
  }
  if (constant) return {y[k], 0.0};
  const Eigen::Vector3d fitted = (h + 1e-12 * Eigen::Matrix3d::Identity()).ldlt().solve(g);
  return {y[k] + fitted[0], fitted[1] / width_s};
}

}  // namespace

std::vector<Segment> cut_segments(const std::vector<Measurement>& runs, double longest_s) {
  std::vector<Segment> segments;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Measurement& run = runs[r];
    const double period = run.median_period_s();
    constexpr double largest_growth = 2.5;  // of the logarithm of an error
    constexpr double upright_rate = 5.0;    // 1/s, of a pendulum of arm's length
    double growth = 0.0;
    std::size_t first = 0;
    auto next_break = run.breaks.begin();
    const auto close = [&](std::size_t last) {
      if (last >= first + 8) segments.push_back({r, first, last});
    };
    for (std::size_t k = 1; k < run.size(); ++k) {
      while (next_break != run.breaks.end() && *next_break < k) ++next_break;
      const bool gap = run.time_s[k] - run.time_s[k - 1] > 5.0 * period ||
                       (next_break != run.breaks.end() && *next_break == k);
      if (run.has_theta())
        growth +=
            upright_rate * std::max(0.0, std::cos(run.theta_rad[k])) * (run.time_s[k] - run.time_s[k - 1]);
      if (gap) {
        close(k - 1);
        // What was commanded in the gap is not known, and may still act for a while: through a delay, and,
        // the more of it there was, through a lag.
        constexpr double at_least_s = 0.1, at_most_s = 0.5;
        const double gap_s = run.time_s[k] - run.time_s[k - 1];
        const double resume_s = run.time_s[k] + std::min(at_least_s + 2.0 * gap_s, at_most_s);
        while (k + 1 < run.size() && run.time_s[k] < resume_s) ++k;
        first = k;
        growth = 0.0;
      } else if (growth > largest_growth || run.time_s[k] - run.time_s[first] >= longest_s ||
                 k + 1 == run.size()) {
        close(k);
        first = k;
        growth = 0.0;
      }
    }
  }
  return segments;
}

namespace {

/// The state of which the sensors show these values.
void undo_sensors(const Dynamics<double>& dynamics, PlantState<double>& state) {
  const auto [cart_gain, theta_gain] = sensor_gains(dynamics);
  state.cart_mps /= cart_gain;
  state.theta_radps /= theta_gain;
  PlantState<double> at_origin = state;
  at_origin.cart_m = at_origin.theta_rad = 0.0;
  const Outputs<double> shown = dynamics.measure(at_origin);
  state.cart_m = (state.cart_m - shown.cart_m) / cart_gain;
  state.theta_rad = (state.theta_rad - shown.theta_rad) / theta_gain;
}

}  // namespace

void follow_sensors(std::vector<PlantState<double>>& starts, const Plant& from, const Plant& to) {
  const PlantModel<double> model_from = make_model<double>(from), model_to = make_model<double>(to);
  const Dynamics<double> before(model_from), after(model_to);
  const auto [cart_gain, theta_gain] = sensor_gains(before);
  for (PlantState<double>& state : starts) {
    const Outputs<double> shown = before.measure(state);
    state.cart_m = shown.cart_m;
    state.theta_rad = shown.theta_rad;
    state.cart_mps *= cart_gain;
    state.theta_radps *= theta_gain;
    undo_sensors(after, state);
  }
}

std::vector<PlantState<double>> guess_starts(const std::vector<Measurement>& runs,
                                             const std::vector<Segment>& segments, const Plant& plant) {
  const PlantModel<double> model = make_model<double>(plant);
  const Dynamics<double> dynamics(model);
  std::vector<PlantState<double>> starts;
  for (const Segment& segment : segments) {
    const Measurement& run = runs[segment.run];
    constexpr double width_s = 0.03;
    PlantState<double> s;
    // Unmeasured angle: hanging at rest.
    s.theta_rad = plant.pendulum ? std::numbers::pi : 0.0;
    if (run.has_cart())
      std::tie(s.cart_m, s.cart_mps) =
          local_fit(run.time_s, run.cart_m, segment.first, segment.first, segment.last, width_s);
    if (run.has_theta() && plant.pendulum)
      std::tie(s.theta_rad, s.theta_radps) =
          local_fit(run.time_s, run.theta_rad, segment.first, segment.first, segment.last, width_s);
    undo_sensors(dynamics, s);
    if (dynamics.has_bristle_state() && s.cart_mps != 0.0) {
      const double direction = s.cart_mps > 0.0 ? 1.0 : -1.0;
      s.bristle_m = direction * dynamics.cart_dry_level(s.cart_m, std::abs(s.cart_mps), direction) /
                    dynamics.bristle_stiffness();
    }
    starts.push_back(s);
  }
  return starts;
}

FitResult fit(const FitData& data, const FitPoint& start, const std::vector<FreeParameter>& free,
              const FitOptions& options) {
  if (data.bound != nullptr) data.bound->check();
  FitResult result = Fitter(data, start, free, options).run();
  if (data.bound != nullptr) data.bound->count(result.work_samples);
  return result;
}

namespace {

/// Where the initial state of one segment goes from several of the same, with noise that carries it over from
/// one basin to the next: a plain simulation past friction or a cogged track has many.
FitResult fit_initial_state_through_noise(const FitData& segment, FitPoint point, const FitOptions& options) {
  const Noise wanted = point.noise;
  double work_samples = 0.0;
  for (const double share : {1.0, 0.1, 0.01, 1e-3}) {
    point.noise.force = std::max(wanted.force, 0.1 * share);
    point.noise.torque = std::max(wanted.torque, 0.01 * share);
    const FitResult carried = fit(segment, point, {}, options);
    work_samples += carried.work_samples;
    if (std::isfinite(carried.objective)) point.starts = carried.point.starts;
  }
  point.noise = wanted;
  FitResult found = fit(segment, point, {}, options);
  found.work_samples += work_samples;
  return found;
}

FitResult fit_initial_state(const FitData& segment, const FitPoint& point, const FitOptions& options) {
  FitResult found = fit(segment, point, {}, options);
  constexpr double suspicious = 1.3;  // so far off, in noise standard deviations, that it may be elsewhere
  if (whitened_rms(found) < suspicious) return found;
  FitResult other = fit_initial_state_through_noise(segment, point, options);
  const double work_samples = found.work_samples + other.work_samples;
  FitResult& better = other.objective < found.objective ? other : found;
  better.work_samples = work_samples;
  return better;
}

}  // namespace

FitResult fit_initial_states(const FitData& data, const FitPoint& start, int most_iterations) {
  FitOptions options;
  options.noise_rounds = 0;
  options.most_iterations = most_iterations;
  if (data.bound != nullptr) data.bound->check();
  std::vector<FitResult> found(data.segments.size());
  parallel_for(found.size(), [&](std::size_t s) {
    found[s] = fit_initial_state({data.runs, {data.segments[s]}},
                                 {start.plant, {start.starts[s]}, start.noise}, options);
  });
  FitResult result;
  result.point = start;
  result.converged = true;
  for (std::size_t s = 0; s < found.size(); ++s) {
    const FitResult& one = found[s];
    result.point.starts[s] = one.point.starts[0];
    result.objective += one.objective;
    result.work_samples += one.work_samples;
    result.converged = result.converged && one.converged;
    result.segment_objective.push_back(one.segment_objective[0]);
    result.segment_chi_square.push_back(one.segment_chi_square[0]);
    result.segment_samples.push_back(one.segment_samples[0]);
    result.block_objective.insert(result.block_objective.end(), one.block_objective.begin(),
                                  one.block_objective.end());
  }
  if (data.bound != nullptr) data.bound->count(result.work_samples);
  return result;
}

FitPoint with_fitted_initial_states(const FitData& data, FitPoint point) {
  const FitResult followed = fit_initial_states(data, point, 6);
  if (std::isfinite(followed.objective)) point.starts = followed.point.starts;
  return point;
}

std::vector<std::vector<LinearStep>> linearise(const FitData& data, const FitPoint& point) {
  std::vector<std::vector<LinearStep>> steps(data.segments.size());
  parallel_for(data.segments.size(), [&](std::size_t s) {
    Normal unused;
    linearise_segment<8>((*data.runs)[data.segments[s].run], data.segments[s], engine_options(), point,
                         point.starts[s], {}, false, steps[s], unused);
  });
  return steps;
}

double whitened_rms(const FitResult& result) {
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t s = 0; s < result.segment_chi_square.size(); ++s) {
    sum += result.segment_chi_square[s];
    count += result.segment_samples[s];
  }
  return std::sqrt(sum / std::max(count, 1e-9));
}

}  // namespace upright
