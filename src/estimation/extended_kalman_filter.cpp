#include "extended_kalman_filter.hpp"

#include <algorithm>
#include <numbers>

namespace upright {

namespace {

double square(double x) {
  return x * x;
}

bool has_channel(const Measurement& run, const Plant& plant, int channel) {
  return channel == 0 ? run.has_cart() : run.has_theta() && plant.pendulum.has_value();
}

std::size_t bristle_effect() {
  static const std::size_t effect = effect_number("bristle_friction");
  return effect;
}

}  // namespace

EkfCovariance::EkfCovariance(const Measurement& run, const Plant& plant, const Noise& noise)
    : noise_(noise),
      present_{has_channel(run, plant, 0), has_channel(run, plant, 1)},
      sensor_variance_{square(run.has_cart() ? run.cart_noise_m() : 1.0),
                       square(run.has_theta() ? run.theta_noise_rad() : 1.0)},
      bristles_(plant.find(bristle_effect()) != nullptr),
      disturbed_(noise.coloured_force_n > 0.0 || noise.coloured_torque_nm > 0.0) {
  p_[states][states] = square(noise.coloured_force_n);
  p_[states + 1][states + 1] = square(noise.coloured_torque_nm);
}

double EkfCovariance::keeps(double period_s) const {
  return std::exp(-period_s / noise_.correlation_s);
}

void EkfCovariance::predict(const LinearStep& step) {
  if (noise_.force == 0.0 && noise_.torque == 0.0 && !disturbed_) return;
  active_ = true;
  if (step.holds[0] > 0.0 || step.holds[1] > 0.0) {
    propagate_creeping(step);
  } else {
    propagate(step);
  }
}

void EkfCovariance::update(const LinearStep& step, int channel) {
  const double c = step.gain[channel];
  const double sensor =
      square(noise_.sensors) * sensor_variance_[channel] + square(noise_.jitter_s * step.rate[channel]);
  variance_ = sensor;
  if (!active_) return;
  const double spread = c * c * p_[channel][channel];
  variance_ += spread;
  const double with_weight = sensor / step.weight[channel] + spread;
  if (disturbed_) return correct<all>(c, channel, with_weight);
  bristles_ ? correct<states>(c, channel, with_weight) : correct<states - 1>(c, channel, with_weight);
}

/// `Moving` states, the last one only with bristles; or all, with disturbances. Inner loops run along rows,
/// which SIMD likes.
template <int Moving>
void EkfCovariance::correct(double c, int channel, double variance) {
  double seen[Moving];
  for (int j = 0; j < Moving; ++j) seen[j] = c * p_[channel][j];
  for (int i = 0; i < Moving; ++i) gain_[i] = seen[i] / variance;
  for (int i = 0; i < Moving; ++i)
    for (int j = 0; j < Moving; ++j) p_[i][j] -= gain_[i] * seen[j];
}

void EkfCovariance::propagate(const LinearStep& step) {
  if (disturbed_) push_by_disturbances(step);
  bristles_ ? propagate<states>(step) : propagate<states - 1>(step);
  if (disturbed_) decay_disturbances(step);
}

/// The velocities change by what the disturbances push: P goes to M P M', where M adds their impulses.
void EkfCovariance::push_by_disturbances(const LinearStep& step) {
  for (int d = 0; d < LinearStep::disturbances; ++d)
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < all; ++j) p_[2 + i][j] += step.impulse[d][i] * p_[states + d][j];
  for (int d = 0; d < LinearStep::disturbances; ++d)
    for (int j = 0; j < all; ++j)
      for (int i = 0; i < 2; ++i) p_[j][2 + i] += step.impulse[d][i] * p_[j][states + d];
}

/// Covariances of states with disturbances follow the transition; the disturbances forget, and are renewed so
/// that they stay as large as they are.
void EkfCovariance::decay_disturbances(const LinearStep& step) {
  const double kept = keeps(step.period_s);
  for (int d = states; d < all; ++d) {
    double carried[states] = {};
    for (int i = 0; i < states; ++i)
      for (int j = 0; j < states; ++j) carried[i] += step.transition[i][j] * p_[j][d];
    for (int i = 0; i < states; ++i) p_[i][d] = p_[d][i] = kept * carried[i];
  }
  const double forgets = square(kept);
  for (int d = states; d < all; ++d)
    for (int e = states; e < all; ++e) p_[d][e] *= forgets;
  p_[states][states] += (1.0 - forgets) * square(noise_.coloured_force_n);
  p_[states + 1][states + 1] += (1.0 - forgets) * square(noise_.coloured_torque_nm);
}

template <int Moving>
void EkfCovariance::propagate(const LinearStep& step) {
  const double f = square(noise_.force) * step.period_s, t = square(noise_.torque) * step.period_s;
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      p_[2 + i][2 + j] += f * step.by_force[i] * step.by_force[j] + t * step.by_torque[i] * step.by_torque[j];
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

/// Statistical linearisation: dv = -(F/m) sign(v) dt + (q/m) dW has a Laplace distribution of speeds, of
/// standard deviation q^2 / (sqrt(2) F m); the linear process with it and the same noise forgets in q^2 /
/// F^2.
EkfCovariance::Creep EkfCovariance::creep_of(const LinearStep& step, int contact, double push) const {
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

void EkfCovariance::propagate_creeping(LinearStep step) {
  const Creep creep[2] = {creep_of(step, 0, step.by_force[0] * noise_.force),
                          creep_of(step, 1, step.by_torque[1] * noise_.torque)};
  for (int c = 0; c < 2; ++c) {
    if (creep[c].speed == 0.0) continue;
    step.transition[2 + c][2 + c] = creep[c].keeps;
    step.transition[c][2 + c] = creep[c].moves_s;
    step.by_force[c] = step.by_torque[c] = 0.0;
  }
  propagate(step);
  for (int c = 0; c < 2; ++c) {
    p_[2 + c][2 + c] += creep[c].rate_variance;
    p_[c][2 + c] = p_[2 + c][c] += creep[c].covariance;
    p_[c][c] += creep[c].place_variance;
  }
}

}  // namespace upright
