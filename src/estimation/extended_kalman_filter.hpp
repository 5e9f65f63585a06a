// The extended Kalman filter along a segment: its covariance and gains. The trajectory itself is that of the
// event engine (linearisation.cpp).
#pragma once

#include <cmath>

#include "linear_step.hpp"
#include "upright/estimation/noise.hpp"
#include "upright/measurement/measurement.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// The noise of one filter (S: double) or of several side by side (S: Lanes). The members are those of Noise.
template <class S>
struct FilterNoise {
  S force, torque, coloured_force_n, coloured_torque_nm, correlation_s, sensors, jitter_s;
  bool pushed;     ///< whether a filter has process noise
  bool disturbed;  ///< whether a filter has coloured process noise
};

/// The noise of one filter.
inline FilterNoise<double> noise_of_filter(const Noise& noise) {
  const bool disturbed = noise.coloured_force_n > 0.0 || noise.coloured_torque_nm > 0.0;
  return {noise.force,
          noise.torque,
          noise.coloured_force_n,
          noise.coloured_torque_nm,
          noise.correlation_s,
          noise.sensors,
          noise.jitter_s,
          noise.force > 0.0 || noise.torque > 0.0 || disturbed,
          disturbed};
}

/// Covariance, gains and innovation variances of one filter (S: double) or of several side by side that
/// follow the same trajectory with different noise (S: Lanes). Under the right model the innovations are
/// white.
template <class S>
class EkfCovariance {
 public:
  EkfCovariance(const Measurement& run, const Plant& plant, const FilterNoise<S>& noise);

  /// Propagates the covariance to the next sample.
  void predict(const LinearStep& step);

  /// Whether a channel is measured and the plant has the quantity.
  bool present(int channel) const { return present_[channel]; }

  /// Updates with one channel. Returns its gain and innovation variance. A weight below one reduces the
  /// correction.
  void update(const LinearStep& step, int channel);

  const S& variance() const { return variance_; }
  /// Of all states and disturbances, in the places of LinearStep::update.
  const S* gain() const { return gain_; }
  /// Whether the noise has a coloured part.
  bool disturbed() const { return noise_.disturbed; }
  /// What of a disturbance remains after so long.
  S keeps(double period_s) const;

 private:
  static constexpr int most_states = LinearStep::states, rigid_states = LinearStep::rigid_states,
                       disturbances = LinearStep::disturbances;

  /// Dry friction under white force: a contact that rests in the model creeps randomly in reality.
  struct Creep {
    bool creeps = false;  ///< whether it does in a filter; in the others all that is added is zero
    S keeps, moves_s;     ///< share of a speed that remains one sample later, and how long it lasts
    S rate_variance, covariance, place_variance;  ///< added over the period
    S stays;                                      ///< 1 where the contact rests in the filter too, else 0
  };
  /// A step along which contacts creep: the same as LinearStep where they do not.
  struct CreepingStep {
    S transition[most_states][most_states];
    S by_force[2], by_torque[2];
    double impulse[disturbances][2];
    double period_s;
  };

  template <int States, bool Disturbed>
  void correct(double c, int channel, const S& variance);
  template <int States, class Step>
  void carry(const Step& step);
  template <int States, class Step>
  void propagate_states(const Step& step);
  template <class Step>
  void propagate(const Step& step);
  template <int States, class Step>
  void push_by_disturbances(const Step& step);
  template <int States, class Step>
  void decay_disturbances(const Step& step);
  void propagate_creeping(const LinearStep& from);
  Creep creep_of(const LinearStep& step, int contact, const S& push) const;

  FilterNoise<S> noise_;
  bool present_[2];
  double sensor_variance_[2];
  bool bristles_;
  int states_;  ///< that the plant may have: the first of all
  bool active_ = false;
  S p_[most_states + disturbances][most_states + disturbances];  ///< of these states, then the disturbances
  S gain_[most_states + disturbances], variance_{1.0};
};

/// Minus twice the log likelihood of innovations, of one filter or of several side by side.
template <class S>
struct LikelihoodOf {
  S chi_square{0.0};
  S log_variance{0.0};
  double samples = 0.0;

  S objective() const { return chi_square + log_variance; }

  /// Adds one innovation.
  void add(const S& innovation, const S& variance, double weight) {
    using std::log;
    chi_square += weight * innovation * innovation / variance;
    log_variance += weight * log(variance);
    samples += weight;
  }
};
using Likelihood = LikelihoodOf<double>;

}  // namespace upright
