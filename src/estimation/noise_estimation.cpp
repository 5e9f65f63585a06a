#include "noise_estimation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel.hpp"
#include "extended_kalman_filter.hpp"
#include "state_vector.hpp"

namespace upright {

namespace {

/// Likelihood of a segment that is linearised, had the noise been another: to first order the filtered
/// trajectory moves by what the other gains would have corrected.
Likelihood likelihood_with_noise(const std::vector<LinearStep>& steps, const Measurement& run,
                                 const Plant& plant, const Noise& noise) {
  EkfCovariance covariance(run, plant, noise);
  Likelihood sum;
  double shift[state_count] = {}, moved[state_count], disturbance[LinearStep::disturbances] = {};
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const LinearStep& step = steps[k];
    if (k > 0) {
      covariance.predict(step);
      for (int d = 0; d < LinearStep::disturbances && covariance.disturbed(); ++d) {
        for (int i = 0; i < 2; ++i) shift[2 + i] += step.impulse[d][i] * disturbance[d];
        disturbance[d] *= covariance.keeps(step.period_s);
      }
      for (int i = 0; i < state_count; ++i) {
        moved[i] = 0.0;
        for (int j = 0; j < state_count; ++j) moved[i] += step.transition[i][j] * shift[j];
      }
      std::copy(moved, moved + state_count, shift);
    }
    double update[state_count] = {};
    for (int channel = 0; channel < 2; ++channel) {
      if (!covariance.present(channel)) continue;
      covariance.update(step, channel);
      const double c = step.gain[channel];
      const double e = step.residual[channel] - c * (shift[channel] + update[channel]);
      sum.add(e, covariance.variance(), step.weight[channel]);
      for (int i = 0; i < state_count; ++i) update[i] += covariance.gain()[i] * e;
      for (int d = 0; d < LinearStep::disturbances; ++d)
        disturbance[d] += covariance.gain()[state_count + d] * e;
    }
    for (int i = 0; i < state_count; ++i) shift[i] += update[i] - step.correction[i];
  }
  return sum;
}

/// One number of the noise, of which the likelihood's maximum is sought.
struct NoiseParameter {
  double Noise::*value;
  double smallest, largest;  ///< below the smallest it is `floor`
  double floor;
  bool used;
  double Noise::*white = nullptr;  ///< of a coloured part: the white part beside it
  int tried_at = -1;               ///< after so many changes of the noise neither way was better
  bool off = false;  ///< nothing, and better so then: the step from there is the same whatever the factor

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
  constexpr double shortest_correlation_s = 0.01, longest_correlation_s = 3.0;
  return {NoiseParameter{&Noise::force, 1e-5, 10.0, 0.0, cart},
          NoiseParameter{&Noise::torque, 1e-7, 1.0, 0.0, pendulum},
          NoiseParameter{&Noise::jitter_s, 1e-6, 1e-2, 0.0, true},
          NoiseParameter{&Noise::sensors, 1.0, 1e3, 1.0, true},
          NoiseParameter{&Noise::coloured_force_n, 1e-5, 1e4, 0.0, coloured && cart, &Noise::force},
          NoiseParameter{&Noise::coloured_torque_nm, 1e-7, 1e3, 0.0, coloured && pendulum, &Noise::torque},
          NoiseParameter{&Noise::correlation_s, shortest_correlation_s, longest_correlation_s,
                         shortest_correlation_s, coloured}};
}

/// A pattern search for the noise of a point.
class PatternSearch {
 public:
  PatternSearch(const FitData& data, const std::vector<LinearisedSegment>& linearised, bool coloured,
                FitPoint& point)
      : data_(data),
        linearised_(linearised),
        point_(point),
        parameters_(noise_parameters(data, point.plant, coloured)),
        objective_(objective_of(point.noise)) {}

  double objective() const { return objective_; }

  /// Multiplies and divides each parameter by a factor until neither is better, three times round at most.
  void search(double factor) {
    for (NoiseParameter& parameter : parameters_)
      if (!parameter.off) parameter.tried_at = -1;
    int so_far = -1;
    for (int sweep = 0; sweep < 3 && changes_ != so_far; ++sweep) {
      so_far = changes_;
      for (NoiseParameter& parameter : parameters_) {
        if (!parameter.used || parameter.tried_at == changes_ || means_nothing(parameter)) continue;
        int moves = line_search(parameter, factor);
        if (moves == 0) moves = line_search(parameter, 1.0 / factor);
        parameter.tried_at = changes_ += moves;
      }
    }
  }

 private:
  /// A correlation time of nothing.
  bool means_nothing(const NoiseParameter& parameter) const {
    return parameter.value == &Noise::correlation_s && point_.noise.coloured_force_n == 0.0 &&
           point_.noise.coloured_torque_nm == 0.0;
  }

  double objective_of(const Noise& noise) const {
    return noise_objective(data_, point_.plant, linearised_, noise);
  }

  /// Moves a parameter of the noise one way for as long as the objective falls; returns how often it did.
  int line_search(NoiseParameter& parameter, double move) {
    constexpr double falls = 1e-3;
    for (int moves = 0;; ++moves) {
      Noise next = point_.noise;
      const double now = next.*parameter.value;
      next.*parameter.value = parameter.moved(next, move);
      if (next.*parameter.value == now) return moves;
      const double reached = objective_of(next);
      if (!(reached < objective_ - falls)) {
        parameter.off = now == 0.0;
        return moves;
      }
      objective_ = reached;
      point_.noise = next;
    }
  }

  const FitData& data_;
  const std::vector<LinearisedSegment>& linearised_;
  FitPoint& point_;
  std::array<NoiseParameter, noise_parameter_count> parameters_;
  double objective_;
  int changes_ = 0;
};

}  // namespace

double noise_objective(const FitData& data, const Plant& plant,
                       const std::vector<LinearisedSegment>& linearised, const Noise& noise) {
  std::vector<double> parts(data.segments.size());
  parallel_for(parts.size(), [&](std::size_t s) {
    parts[s] = likelihood_with_noise(linearised[s].steps, (*data.runs)[data.segments[s].run], plant, noise)
                   .objective();
  });
  double sum = 0.0;
  for (const double part : parts) sum += part;
  return sum;
}

double estimate_noise(const FitData& data, const std::vector<LinearisedSegment>& linearised,
                      const std::vector<double>& factors, bool coloured, FitPoint& point) {
  PatternSearch pattern(data, linearised, coloured, point);
  const double before = pattern.objective();
  for (const double factor : factors) pattern.search(factor);
  return before - pattern.objective();
}

}  // namespace upright
