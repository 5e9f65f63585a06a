#include "extended_kalman_filter.hpp"

#include <algorithm>
#include <numbers>

#include "sim/loop/lanes.hpp"
#include "state_vector.hpp"

namespace upright {

namespace {

template <class S>
S square(const S& x) {
  return x * x;
}

// One filter is like several: the conditions of each choose.
bool any(bool condition) {
  return condition;
}
double select(bool condition, double yes, double no) {
  return condition ? yes : no;
}
double larger(double a, double b) {
  return std::max(a, b);
}
double smaller(double a, double b) {
  return std::min(a, b);
}

bool has_channel(const Measurement& run, const Plant& plant, int channel) {
  return channel == 0 ? run.has_cart() : run.has_theta() && plant.pendulum.has_value();
}

std::size_t bristle_effect() {
  static const std::size_t effect = effect_number("bristle_friction");
  return effect;
}

/// Below this the differences in `SpeedDecay` are those of a power series, whose relative error is 1e-9
/// there.
constexpr double short_periods = 0.25;

/// How a speed that is pushed at random decays over p times its relaxation time, and what it adds up to.
template <class S>
struct SpeedDecay {
  S keeps;  ///< exp(-p)
  S lost;   ///< 1 - exp(-p)
  S place;  ///< 2 p - (1 - exp(-p)) (3 - exp(-p))

  explicit SpeedDecay(const S& p) {
    using std::exp;
    keeps = exp(-p);
    const auto small = p < S(short_periods);
    S lost_series(1.0), place_series(0.0);
    for (int k = 8; k > 1; --k) lost_series = S(1.0) - p * lost_series * (1.0 / k);
    // The coefficient of p^k is (-1)^k (4 - 2^k) / k!.
    constexpr double coefficients[] = {-1020.0 / 3628800.0, 508.0 / 362880.0, -252.0 / 40320.0,
                                       124.0 / 5040.0,      -60.0 / 720.0,    28.0 / 120.0,
                                       -12.0 / 24.0,        4.0 / 6.0};
    for (const double c : coefficients) place_series = place_series * p + c;
    lost = select(small, p * lost_series, 1.0 - keeps);
    place = select(small, p * p * p * place_series, larger(S(0.0), 2.0 * p - lost * (3.0 - keeps)));
  }
};

}  // namespace

template <class S>
EkfCovariance<S>::EkfCovariance(const Measurement& run, const Plant& plant, const FilterNoise<S>& noise)
    : noise_(noise),
      present_{has_channel(run, plant, 0), has_channel(run, plant, 1)},
      sensor_variance_{square(run.has_cart() ? run.cart_noise_m() : 1.0),
                       square(run.has_theta() ? run.theta_noise_rad() : 1.0)},
      bristles_(plant.find(bristle_effect()) != nullptr),
      states_(estimated_states(plant)) {
  for (auto& row : p_)
    for (S& element : row) element = S(0.0);
  for (S& element : gain_) element = S(0.0);
  p_[states_][states_] = square(noise.coloured_force_n);
  p_[states_ + 1][states_ + 1] = square(noise.coloured_torque_nm);
}

template <class S>
S EkfCovariance<S>::keeps(double period_s) const {
  using std::exp;
  return exp(-period_s / noise_.correlation_s);
}

template <class S>
void EkfCovariance<S>::predict(const LinearStep& step) {
  if (!noise_.pushed) return;
  active_ = true;
  if (step.holds[0] > 0.0 || step.holds[1] > 0.0) {
    propagate_creeping(step);
  } else {
    propagate(step);
  }
}

template <class S>
void EkfCovariance<S>::update(const LinearStep& step, int channel) {
  const double c = step.gain[channel];
  const S sensor =
      square(noise_.sensors) * sensor_variance_[channel] + square(noise_.jitter_s * step.rate[channel]);
  variance_ = sensor;
  if (!active_) return;
  const S spread = c * c * p_[channel][channel];
  variance_ = variance_ + spread;
  const S with_weight = sensor * (1.0 / step.weight[channel]) + spread;
  const bool attached = states_ == most_states;
  if (noise_.disturbed)
    return attached ? correct<most_states, true>(c, channel, with_weight)
                    : correct<rigid_states, true>(c, channel, with_weight);
  if (attached) return correct<most_states, false>(c, channel, with_weight);
  bristles_ ? correct<rigid_states, false>(c, channel, with_weight)
            : correct<rigid_states - 1, false>(c, channel, with_weight);
}

/// `States` of them, the fifth only with bristles, and the disturbances. Inner loops run along rows, which
/// SIMD likes.
template <class S>
template <int States, bool Disturbed>
void EkfCovariance<S>::correct(double c, int channel, const S& variance) {
  constexpr int all = States + (Disturbed ? disturbances : 0);
  constexpr auto place = [](int i) { return i < States ? i : i - States + most_states; };
  S seen[all];
  for (int j = 0; j < all; ++j) seen[j] = c * p_[channel][j];
  const S per_variance = 1.0 / variance;
  for (int i = 0; i < all; ++i) gain_[place(i)] = seen[i] * per_variance;
  for (int i = 0; i < all; ++i)
    for (int j = 0; j < all; ++j) p_[i][j] = p_[i][j] - gain_[place(i)] * seen[j];
}

template <class S>
template <class Step>
void EkfCovariance<S>::propagate(const Step& step) {
  states_ == most_states ? propagate_states<most_states>(step) : propagate_states<rigid_states>(step);
}

template <class S>
template <int States, class Step>
void EkfCovariance<S>::propagate_states(const Step& step) {
  if (noise_.disturbed) push_by_disturbances<States>(step);
  // Without bristles the fifth and last state of a rigid plant has no covariances.
  if (States == rigid_states && !bristles_)
    carry<rigid_states - 1>(step);
  else
    carry<States>(step);
  if (noise_.disturbed) decay_disturbances<States>(step);
}

/// The velocities change by what the disturbances push: P goes to M P M', where M adds their impulses.
template <class S>
template <int States, class Step>
void EkfCovariance<S>::push_by_disturbances(const Step& step) {
  constexpr int all = States + disturbances;
  for (int d = 0; d < disturbances; ++d)
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < all; ++j) p_[2 + i][j] += step.impulse[d][i] * p_[States + d][j];
  for (int d = 0; d < disturbances; ++d)
    for (int j = 0; j < all; ++j)
      for (int i = 0; i < 2; ++i) p_[j][2 + i] += step.impulse[d][i] * p_[j][States + d];
}

/// Covariances of states with disturbances follow the transition; the disturbances forget, and are renewed so
/// that they stay as large as they are.
template <class S>
template <int States, class Step>
void EkfCovariance<S>::decay_disturbances(const Step& step) {
  constexpr int all = States + disturbances;
  const S kept = keeps(step.period_s);
  for (int d = States; d < all; ++d) {
    S carried[States];
    for (int i = 0; i < States; ++i) {
      carried[i] = step.transition[i][0] * p_[0][d];
      for (int j = 1; j < States; ++j) carried[i] += step.transition[i][j] * p_[j][d];
    }
    for (int i = 0; i < States; ++i) p_[i][d] = p_[d][i] = kept * carried[i];
  }
  const S forgets = square(kept);
  for (int d = States; d < all; ++d)
    for (int e = States; e < all; ++e) p_[d][e] = p_[d][e] * forgets;
  p_[States][States] += (1.0 - forgets) * square(noise_.coloured_force_n);
  p_[States + 1][States + 1] += (1.0 - forgets) * square(noise_.coloured_torque_nm);
}

template <class S>
template <int States, class Step>
void EkfCovariance<S>::carry(const Step& step) {
  const S f = square(noise_.force) * step.period_s, t = square(noise_.torque) * step.period_s;
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      p_[2 + i][2 + j] += f * step.by_force[i] * step.by_force[j] + t * step.by_torque[i] * step.by_torque[j];
  S half[States][States];
  for (int i = 0; i < States; ++i) {
    for (int j = 0; j < States; ++j) half[i][j] = step.transition[i][0] * p_[0][j];
    for (int k = 1; k < States; ++k)
      for (int j = 0; j < States; ++j) half[i][j] += step.transition[i][k] * p_[k][j];
  }
  // P goes to T P T', which is symmetric.
  for (int i = 0; i < States; ++i)
    for (int j = 0; j <= i; ++j) {
      S sum = half[i][0] * step.transition[j][0];
      for (int k = 1; k < States; ++k) sum += half[i][k] * step.transition[j][k];
      p_[i][j] = p_[j][i] = sum;
    }
}

/// Statistical linearisation: dv = -(F/m) sign(v) dt + (q/m) dW has a Laplace distribution of speeds, of
/// standard deviation q^2 / (sqrt(2) F m); the linear process with it and the same noise forgets in q^2 /
/// F^2.
template <class S>
typename EkfCovariance<S>::Creep EkfCovariance<S>::creep_of(const LinearStep& step, int contact,
                                                            const S& push) const {
  Creep creep;
  if (!(step.holds[contact] > 0.0)) return creep;
  const double decay = step.holds[contact] * (contact == 0 ? step.by_force[0] : step.by_torque[1]);
  const S squared = square(push);
  const S speed = squared * (1.0 / (std::numbers::sqrt2 * decay)),
          forgets_s = squared * (1.0 / square(decay));
  constexpr double shows = 0.01;  // of the sensor's noise in a sample: less is rest
  const auto moves =
      square(speed * smaller(forgets_s, S(step.period_s))) >= S(square(shows) * sensor_variance_[contact]);
  if (!any(moves)) return creep;
  creep.creeps = true;
  const S memory_s = select(moves, forgets_s, S(1.0));
  const SpeedDecay<S> decay_of_speed(step.period_s / memory_s);
  const S one(1.0), zero(0.0);
  creep.stays = select(moves, zero, one);
  creep.keeps = decay_of_speed.keeps;
  creep.moves_s = memory_s * decay_of_speed.lost;
  creep.rate_variance =
      select(moves, square(speed) * decay_of_speed.lost * (1.0 + decay_of_speed.keeps), zero);
  creep.covariance = select(moves, square(speed) * memory_s * square(decay_of_speed.lost), zero);
  creep.place_variance = select(moves, square(speed * memory_s) * decay_of_speed.place, zero);
  return creep;
}

template <class S>
void EkfCovariance<S>::propagate_creeping(const LinearStep& from) {
  const Creep creep[2] = {creep_of(from, 0, from.by_force[0] * noise_.force),
                          creep_of(from, 1, from.by_torque[1] * noise_.torque)};
  if (!creep[0].creeps && !creep[1].creeps) return propagate(from);
  CreepingStep step;
  for (int i = 0; i < states_; ++i)
    for (int j = 0; j < states_; ++j) step.transition[i][j] = S(from.transition[i][j]);
  for (int i = 0; i < 2; ++i) {
    step.by_force[i] = S(from.by_force[i]);
    step.by_torque[i] = S(from.by_torque[i]);
    for (int d = 0; d < disturbances; ++d) step.impulse[d][i] = from.impulse[d][i];
  }
  step.period_s = from.period_s;
  for (int c = 0; c < 2; ++c) {
    if (!creep[c].creeps) continue;
    const S& stays = creep[c].stays;
    const S creeps = 1.0 - stays;
    step.transition[2 + c][2 + c] = stays * step.transition[2 + c][2 + c] + creeps * creep[c].keeps;
    step.transition[c][2 + c] = stays * step.transition[c][2 + c] + creeps * creep[c].moves_s;
    step.by_force[c] = stays * step.by_force[c];
    step.by_torque[c] = stays * step.by_torque[c];
  }
  propagate(step);
  for (int c = 0; c < 2; ++c) {
    if (!creep[c].creeps) continue;
    p_[2 + c][2 + c] += creep[c].rate_variance;
    p_[c][2 + c] += creep[c].covariance;
    p_[2 + c][c] = p_[c][2 + c];
    p_[c][c] += creep[c].place_variance;
  }
}

template class EkfCovariance<double>;
template class EkfCovariance<Lanes>;

}  // namespace upright
