#include "noise_estimation.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/parallel.hpp"
#include "extended_kalman_filter.hpp"
#include "held_out.hpp"
#include "model/dense_algebra.hpp"
#include "sim/loop/lanes.hpp"
#include "state_vector.hpp"

namespace upright {

namespace {

/// As many noises as there are lanes. Those that are missing are the last one again.
FilterNoise<Lanes> noise_of_filters(const Noise* noises, std::size_t count) {
  const auto lanes = [&](double Noise::*member) {
    std::array<double, lane_count> values;
    for (std::size_t i = 0; i < lane_count; ++i) values[i] = noises[std::min(i, count - 1)].*member;
    return Lanes::load(values.data());
  };
  bool pushed = false, disturbed = false;
  for (std::size_t i = 0; i < count; ++i) {
    const FilterNoise<double> one = noise_of_filter(noises[i]);
    pushed = pushed || one.pushed;
    disturbed = disturbed || one.disturbed;
  }
  return {lanes(&Noise::force),
          lanes(&Noise::torque),
          lanes(&Noise::coloured_force_n),
          lanes(&Noise::coloured_torque_nm),
          lanes(&Noise::correlation_s),
          lanes(&Noise::sensors),
          lanes(&Noise::jitter_s),
          pushed,
          disturbed};
}

/// Objectives of a segment that is linearised, had the noise been another: to first order the filtered
/// trajectory moves by what the other gains would have corrected. `States`: that the plant has.
template <int States>
Lanes objectives_with_noise(const std::vector<LinearStep>& steps, const Measurement& run, const Plant& plant,
                            const FilterNoise<Lanes>& noise) {
  EkfCovariance<Lanes> covariance(run, plant, noise);
  LikelihoodOf<Lanes> sum;
  Lanes shift[States], moved[States], disturbance[LinearStep::disturbances];
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const LinearStep& step = steps[k];
    if (k > 0) {
      covariance.predict(step);
      if (covariance.disturbed()) {
        const Lanes keeps = covariance.keeps(step.period_s);
        for (int d = 0; d < LinearStep::disturbances; ++d) {
          for (int i = 0; i < 2; ++i) shift[2 + i] += step.impulse[d][i] * disturbance[d];
          disturbance[d] = keeps * disturbance[d];
        }
      }
      for (int i = 0; i < States; ++i) {
        moved[i] = step.transition[i][0] * shift[0];
        for (int j = 1; j < States; ++j) moved[i] += step.transition[i][j] * shift[j];
      }
      std::copy(moved, moved + States, shift);
    }
    Lanes update[States];
    for (int channel = 0; channel < 2; ++channel) {
      if (!covariance.present(channel)) continue;
      covariance.update(step, channel);
      const Lanes e = step.residual[channel] - step.gain[channel] * (shift[channel] + update[channel]);
      sum.add(e, covariance.variance(), step.weight[channel]);
      for (int i = 0; i < States; ++i) update[i] += covariance.gain()[i] * e;
      for (int d = 0; d < LinearStep::disturbances; ++d)
        disturbance[d] += covariance.gain()[state_count + d] * e;
    }
    for (int i = 0; i < States; ++i) shift[i] += update[i] - Lanes(step.correction[i]);
  }
  return sum.objective();
}

/// One number of the noise, of which the likelihood's maximum is sought.
struct NoiseParameter {
  double Noise::*value;
  double smallest, largest;  ///< below the smallest it is `floor`
  double floor;
  bool used;
  double Noise::*white = nullptr;  ///< of a coloured part: the white part beside it

  double moved(const Noise& noise, double move) const {
    const double now = noise.*value;
    const double to = now == 0.0 ? (move > 1.0 ? from_nothing(noise) : 0.0) : now * move;
    return to < smallest ? floor : std::min(to, largest);
  }

 private:
  /// A coloured part is tried where it is as strong at low frequencies as the white one.
  double from_nothing(const Noise& noise) const {
    if (white == nullptr) return smallest * 10.0;
    return std::max(noise.*white / std::sqrt(2.0 * noise.correlation_s), smallest * 10.0);
  }
};

constexpr std::size_t noise_parameter_count = 7;

std::array<NoiseParameter, noise_parameter_count> noise_parameters(const FitData& data, const Plant& plant,
                                                                   bool coloured) {
  bool cart = false, pendulum = false;
  for (const Measurement& run : *data.runs) {
    cart = cart || run.has_cart();
    pendulum = pendulum || (run.has_theta() && plant.pendulum);
  }
  constexpr double shortest_correlation_s = 0.01;
  return {NoiseParameter{&Noise::force, 1e-5, 10.0, 0.0, cart},
          NoiseParameter{&Noise::torque, 1e-7, 1.0, 0.0, pendulum},
          NoiseParameter{&Noise::jitter_s, 1e-6, 1e-2, 0.0, true},
          NoiseParameter{&Noise::sensors, 1.0, 1e3, 1.0, true},
          NoiseParameter{&Noise::coloured_force_n, 1e-5, 1e4, 0.0, coloured && cart, &Noise::force},
          NoiseParameter{&Noise::coloured_torque_nm, 1e-7, 1e3, 0.0, coloured && pendulum, &Noise::torque},
          NoiseParameter{&Noise::correlation_s, shortest_correlation_s, longest_correlation_s,
                         shortest_correlation_s, coloured}};
}

/// A pattern search for the noise of a point. Many noises cost little more than one, so each pass over the
/// data looks at every way at once.
class PatternSearch {
 public:
  PatternSearch(const FitData& data, const std::vector<LinearisedSegment>& linearised, bool coloured,
                FitPoint& point)
      : data_(data),
        linearised_(linearised),
        point_(point),
        coloured_(coloured),
        parameters_(noise_parameters(data, point.plant, coloured)),
        objective_(objectives_of({point.noise}).front()) {}

  double objective() const { return objective_; }

  /// Multiplies and divides numbers of the noise by a factor until no way is better.
  void search(double factor) {
    for (int pass = 0; pass < max_passes; ++pass) {
      look_around(factor);
      if (!go_on(factor)) return;
    }
  }

  /// Newton steps in the logarithms of those numbers that are not at a bound. The size and the correlation
  /// time of a disturbance hardly change the objective if they change together, where search() goes no
  /// further.
  void refine(double factor) {
    const int steps = coloured_ ? max_newton_steps : 1;
    for (int step = 0; step < steps; ++step) {
      const double before = objective_;
      if (looked_at_ != objective_) look_around(factor);
      if (!take_newton_step(factor) || before - objective_ < no_matter) return;
    }
  }

 private:
  /// A bound on the work of each factor. Most searches need two to four passes.
  static constexpr int max_passes = 12;
  /// Less is no fall.
  static constexpr double falls = 1e-3;
  /// A bound on the work beside a coloured part. Without one a single step is enough.
  static constexpr int max_newton_steps = 6;
  /// [minus twice the log likelihood] A Newton step that brings less is the last one.
  static constexpr double no_matter = 0.05;

  /// A correlation time of nothing.
  bool means_nothing(const NoiseParameter& parameter) const {
    return parameter.value == &Noise::correlation_s && point_.noise.coloured_force_n == 0.0 &&
           point_.noise.coloured_torque_nm == 0.0;
  }

  Noise with(std::size_t j, double move) const {
    Noise noise = point_.noise;
    noise.*parameters_[j].value = parameters_[j].moved(noise, move);
    return noise;
  }

  std::vector<double> objectives_of(const std::vector<Noise>& noises) const {
    return noise_objectives(data_, point_.plant, linearised_, noises);
  }

  /// The objectives with each number changed alone, one way and the other. Infinite where it cannot be.
  void look_around(double factor) {
    std::vector<Noise> noises;
    std::vector<double*> places;
    for (std::size_t j = 0; j < parameters_.size(); ++j) {
      below_[j] = above_[j] = std::numeric_limits<double>::infinity();
      if (!parameters_[j].used || means_nothing(parameters_[j])) continue;
      for (const bool up : {false, true}) {
        const Noise noise = with(j, up ? factor : 1.0 / factor);
        if (noise.*parameters_[j].value == point_.noise.*parameters_[j].value) continue;
        noises.push_back(noise);
        places.push_back(up ? &above_[j] : &below_[j]);
      }
    }
    const std::vector<double> objectives = objectives_of(noises);
    for (std::size_t i = 0; i < places.size(); ++i) *places[i] = objectives[i];
    looked_at_ = objective_;
  }

  /// Changes all numbers that are better changed together, and the best one alone, by several powers of the
  /// factor. Whether that is better.
  bool go_on(double factor) {
    std::array<double, noise_parameter_count> moves{};
    std::size_t best = 0, changed = 0;
    const auto least = [&](std::size_t j) { return std::min(below_[j], above_[j]); };
    for (std::size_t j = 0; j < parameters_.size(); ++j) {
      if (!(least(j) < objective_ - falls)) continue;
      moves[j] = above_[j] < below_[j] ? factor : 1.0 / factor;
      if (changed++ == 0 || least(j) < least(best)) best = j;
    }
    if (changed == 0) return false;
    std::vector<Noise> noises;
    for (const int power : {1, 2, 3, 4}) {
      Noise joint = point_.noise;
      for (std::size_t j = 0; j < parameters_.size(); ++j)
        if (moves[j] != 0.0)
          joint.*parameters_[j].value = parameters_[j].moved(point_.noise, std::pow(moves[j], power));
      noises.push_back(joint);
      if (changed > 1) noises.push_back(with(best, std::pow(moves[best], power)));
    }
    return take_best(noises);
  }

  /// Derivatives of the objective by powers of the factor, from differences.
  struct QuadraticModel {
    std::vector<std::size_t> numbers;  ///< of the noise
    Eigen::VectorXd slope;
    Eigen::MatrixXd curvature;
  };

  /// Of what look_around() saw. Mixed derivatives matter beside a coloured part only.
  QuadraticModel quadratic_model(double factor) const {
    QuadraticModel model;
    for (std::size_t j = 0; j < parameters_.size(); ++j)
      if (std::isfinite(below_[j] + above_[j]) && point_.noise.*parameters_[j].value > 0.0)
        model.numbers.push_back(j);
    const auto n = static_cast<Eigen::Index>(model.numbers.size());
    model.slope.resize(n);
    model.curvature.setZero(n, n);
    std::vector<Noise> noises;
    for (Eigen::Index a = 0; a < n; ++a) {
      const std::size_t j = model.numbers[static_cast<std::size_t>(a)];
      model.slope[a] = 0.5 * (above_[j] - below_[j]);
      model.curvature(a, a) = above_[j] + below_[j] - 2.0 * objective_;
      for (Eigen::Index b = 0; coloured_ && b < a; ++b) {
        Noise both = with(j, factor);
        const NoiseParameter& other = parameters_[model.numbers[static_cast<std::size_t>(b)]];
        both.*other.value = other.moved(both, factor);
        noises.push_back(both);
      }
    }
    const std::vector<double> objectives = objectives_of(noises);
    auto next = objectives.begin();
    for (Eigen::Index a = 0; a < n; ++a)
      for (Eigen::Index b = 0; coloured_ && b < a; ++b)
        model.curvature(a, b) = model.curvature(b, a) =
            *next++ - above_[model.numbers[static_cast<std::size_t>(a)]] -
            above_[model.numbers[static_cast<std::size_t>(b)]] + objective_;
    return model;
  }

  /// The best of several steps that are damped more or less. Whether it is better than none.
  bool take_newton_step(double factor) {
    constexpr double longest = 8.0;  // powers of the factor: the model is not valid further away
    // Finer powers say nothing, and would bring each processor's rounding into the noise.
    constexpr double parts = 64.0;
    const QuadraticModel model = quadratic_model(factor);
    if (model.numbers.empty()) return false;
    std::vector<Noise> noises;
    for (const double damping : {1e-6, 0.03, 0.3, 3.0}) {
      Eigen::MatrixXd damped = model.curvature;
      for (Eigen::Index a = 0; a < damped.rows(); ++a)
        damped(a, a) += damping * std::max(std::abs(damped(a, a)), falls);
      const Eigen::VectorXd step = solve_symmetric(damped, Eigen::VectorXd(-model.slope));
      Noise moved = point_.noise;
      for (Eigen::Index a = 0; a < step.size(); ++a) {
        if (!std::isfinite(step[a])) continue;
        const NoiseParameter& parameter = parameters_[model.numbers[static_cast<std::size_t>(a)]];
        const double power = std::round(parts * std::clamp(step[a], -longest, longest)) / parts;
        moved.*parameter.value = parameter.moved(moved, std::pow(factor, power));
      }
      noises.push_back(moved);
    }
    return take_best(noises);
  }

  /// Takes the best of these if it is better than what is there.
  bool take_best(const std::vector<Noise>& noises) {
    if (noises.empty()) return false;
    const std::vector<double> objectives = objectives_of(noises);
    const auto best = std::min_element(objectives.begin(), objectives.end());
    if (!(*best < objective_ - falls)) return false;
    objective_ = *best;
    point_.noise = noises[static_cast<std::size_t>(best - objectives.begin())];
    return true;
  }

  const FitData& data_;
  const std::vector<LinearisedSegment>& linearised_;
  FitPoint& point_;
  bool coloured_;
  std::array<NoiseParameter, noise_parameter_count> parameters_;
  double objective_;
  std::array<double, noise_parameter_count> below_{}, above_{};  ///< of look_around()
  double looked_at_ = std::numeric_limits<double>::quiet_NaN();  ///< the objective there
};

}  // namespace

std::vector<double> noise_objectives(const FitData& data, const Plant& plant,
                                     const std::vector<LinearisedSegment>& linearised,
                                     const std::vector<Noise>& noises) {
  const auto objectives = estimated_states(plant) == state_count
                              ? objectives_with_noise<state_count>
                              : objectives_with_noise<LinearStep::rigid_states>;
  std::vector<FilterNoise<Lanes>> together;
  for (std::size_t first = 0; first < noises.size(); first += lane_count)
    together.push_back(noise_of_filters(noises.data() + first, std::min(lane_count, noises.size() - first)));
  std::vector<std::array<double, lane_count>> parts(data.segments.size() * together.size());
  parallel_for(parts.size(), [&](std::size_t i) {
    const std::size_t s = i / together.size();
    const Measurement& run = (*data.runs)[data.segments[s].run];
    parts[i] = objectives(linearised[s].steps, run, plant, together[i % together.size()]).values();
  });
  std::vector<double> sums(noises.size(), 0.0);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t first = i % together.size() * lane_count;
    for (std::size_t n = first; n < std::min(first + lane_count, noises.size()); ++n)
      sums[n] += parts[i][n - first];
  }
  for (double& sum : sums)
    if (!std::isfinite(sum)) sum = std::numeric_limits<double>::infinity();
  return sums;
}

namespace {

/// Every few segments: enough samples for coarse steps of a few numbers.
std::vector<std::size_t> some_segments(const FitData& data) {
  constexpr double enough_samples = 5000.0;
  const auto stride = static_cast<std::size_t>(std::max(sample_count(data) / enough_samples, 1.0));
  std::vector<std::size_t> some;
  for (std::size_t s = stride / 2; s < data.segments.size(); s += stride) some.push_back(s);
  return some;
}

/// The coarse steps, with some of the segments only.
void estimate_coarsely(const FitData& data, const std::vector<LinearisedSegment>& linearised,
                       const std::vector<double>& factors, bool coloured, FitPoint& point) {
  FitData part = data;
  part.segments.clear();
  std::vector<LinearisedSegment> linearised_part;
  for (const std::size_t s : some_segments(data)) {
    part.segments.push_back(data.segments[s]);
    linearised_part.push_back(linearised[s]);
  }
  PatternSearch pattern(part, linearised_part, coloured, point);
  for (const double factor : factors) pattern.search(factor);
}

}  // namespace

double estimate_noise(const FitData& data, const std::vector<LinearisedSegment>& linearised,
                      const std::vector<double>& factors, bool coloured, FitPoint& point) {
  const Noise former = point.noise;
  const std::vector<double> coarse(factors.begin(), factors.end() - 1);
  if (!coarse.empty()) estimate_coarsely(data, linearised, coarse, coloured, point);
  PatternSearch pattern(data, linearised, coloured, point);
  const double before = coarse.empty() ? pattern.objective()
                                       : noise_objectives(data, point.plant, linearised, {former}).front();
  pattern.search(factors.back());
  pattern.refine(factors.back());
  if (pattern.objective() < before) return before - pattern.objective();
  point.noise = former;
  return 0.0;
}

}  // namespace upright
