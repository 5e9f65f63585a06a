// The extended Kalman filter along a segment: its covariance and gains. The trajectory itself is that of the
// event engine (linearisation.cpp).
#pragma once

#include <cmath>
#include <limits>

#include "linear_step.hpp"
#include "upright/estimation/noise.hpp"
#include "upright/measurement/measurement.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// Covariance, gains and innovation variances of the filter. Under the right model its innovations are white.
class EkfCovariance {
 public:
  EkfCovariance(const Measurement& run, const Plant& plant, const Noise& noise);

  /// Propagates the covariance to the next sample.
  void predict(const LinearStep& step);

  /// Whether a channel is measured and the plant has the quantity.
  bool present(int channel) const { return present_[channel]; }

  /// Updates with one channel. Returns its gain and innovation variance. A weight below one reduces the
  /// correction.
  void update(const LinearStep& step, int channel);

  double variance() const { return variance_; }
  /// Of all states and disturbances.
  const double* gain() const { return gain_; }
  /// Whether the noise has a coloured part.
  bool disturbed() const { return disturbed_; }
  /// What of a disturbance remains after so long.
  double keeps(double period_s) const;

 private:
  static constexpr int states = LinearStep::states, all = states + LinearStep::disturbances;

  /// Dry friction under white force: a contact that rests in the model creeps randomly in reality.
  struct Creep {
    double speed = 0.0;  ///< standard deviation; 0 at rest
    double keeps = 0.0;  ///< share of a speed that remains one sample later
    double moves_s = 0.0;
    double rate_variance = 0.0, covariance = 0.0, place_variance = 0.0;
  };

  template <int Moving>
  void correct(double c, int channel, double variance);
  template <int Moving>
  void propagate(const LinearStep& step);
  void propagate(const LinearStep& step);
  void push_by_disturbances(const LinearStep& step);
  void decay_disturbances(const LinearStep& step);
  void propagate_creeping(LinearStep step);
  Creep creep_of(const LinearStep& step, int contact, double push) const;

  Noise noise_;
  bool present_[2];
  double sensor_variance_[2];
  bool bristles_;
  bool disturbed_;
  bool active_ = false;
  double p_[all][all] = {};
  double gain_[all] = {}, variance_ = 1.0;
};

/// Minus twice the log likelihood of innovations.
struct Likelihood {
  double chi_square = 0.0;
  double log_variance = 0.0;
  double samples = 0.0;

  double objective() const { return chi_square + log_variance; }

  /// Adds one innovation. A value that is not finite makes it infinite.
  void add(double innovation, double variance, double weight) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    chi_square += std::isfinite(innovation) ? weight * innovation * innovation / variance : infinity;
    log_variance += weight * std::log(variance);
    samples += weight;
  }
};

}  // namespace upright
