#include "delay_margin.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <numbers>

#include "characteristic_roots.hpp"
#include "control/kalman_filter.hpp"
#include "controllable_part.hpp"
#include "linear_sampled_loop.hpp"
#include "model/dense_algebra.hpp"
#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;

constexpr double two_pi = 2.0 * std::numbers::pi;
/// How far on either side of the critical delay the roots are looked at.
constexpr double aside = 1e-3;
/// A root this near to the boundary [1/s] counts as on it, so as not stable.
constexpr double on_the_boundary_per_s = 1e-9;

/// Loop gain on the boundary of stability as a function of frequency [rad/s].
using LoopGain = std::function<Complex(double)>;

/// The frequency between `low` and `high`, where log |gain| has different signs, at which it is zero.
double bisected(const LoopGain& gain, double low, double high) {
  const bool rising = std::abs(gain(high)) > 1.0;
  constexpr int max_halvings = 200;
  for (int i = 0; i < max_halvings; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) break;
    if ((std::abs(gain(middle)) > 1.0) == rising)
      high = middle;
    else
      low = middle;
  }
  return 0.5 * (low + high);
}

/// Smallest delay >= `min_s` at which gain e^(-j w delay) = 1.
double delay_at(Complex gain, double frequency, double min_s) {
  double delay = std::arg(gain) / frequency;
  const double turn = two_pi / frequency;
  delay += turn * std::ceil((min_s - delay) / turn);
  return delay < min_s ? delay + turn : delay;
}

bool gain_falls(const LoopGain& gain, double frequency) {
  constexpr double step = 1e-6;
  return std::abs(gain(frequency * (1.0 + step))) < std::abs(gain(frequency * (1.0 - step)));
}

void choose_critical(LoopMargin& margin) {
  std::sort(margin.crossings.begin(), margin.crossings.end(),
            [](const Crossing& a, const Crossing& b) { return a.delay_s < b.delay_s; });
  if (!margin.stable_without_delay) return;
  margin.critical_delay_s = std::numeric_limits<double>::infinity();
  for (const Crossing& crossing : margin.crossings)
    if (crossing.destabilizing) {
      margin.critical_delay_s = crossing.delay_s;
      margin.crossing_radps = crossing.frequency_radps;
      return;
    }
}

template <class Root>
void confirm_by_roots(LoopMargin& margin, const Root& root) {
  if (!margin.stable_without_delay || !std::isfinite(margin.critical_delay_s)) return;
  Confirmation found;
  found.below_s = margin.critical_delay_s * (1.0 - aside);
  found.above_s = margin.critical_delay_s * (1.0 + aside);
  found.below = root(found.below_s);
  found.above = root(found.above_s);
  found.confirmed = found.below.real() < 0.0 && found.above.real() > 0.0;
  margin.confirmation = found;
}

Eigen::RowVectorXd feedback_of(const LinearPlant& linear, const ControllablePart& part, const Gains& gains) {
  const std::array<double, fed_back_count> all = {gains.cart_position_v_per_m, gains.pendulum_angle_v_per_rad,
                                                  gains.cart_velocity_v_per_mps,
                                                  gains.pendulum_rate_v_per_radps};
  Eigen::RowVectorXd k = Eigen::RowVectorXd::Zero(part.a.rows());
  for (std::size_t i = 0; i < linear.fed_back.size(); ++i) {
    const auto at = static_cast<Index>(i);
    k(at) = all[linear.fed_back[i]] * linear.sensor_scale(at);
  }
  return k;
}

/// Frequencies where |G(jw)| = 1: the imaginary eigenvalues of a Hamiltonian matrix (Boyd, Balakrishnan,
/// Kabamba 1989), each made sharp by bisection.
std::vector<double> unit_gain_frequencies(const DelayedFeedback& loop, const LoopGain& gain) {
  const Index n = loop.a.rows();
  MatrixXd hamiltonian(2 * n, 2 * n);
  hamiltonian << loop.a, loop.b * loop.b.transpose(), -loop.k.transpose() * loop.k, -loop.a.transpose();
  const Eigen::VectorXcd values = eigenvalues(hamiltonian);
  std::vector<double> candidates;
  for (const Complex& value : values)
    if (value.imag() > 0.0) candidates.push_back(value.imag());
  std::sort(candidates.begin(), candidates.end());
  // Between neighbouring candidates |G| stays on one side of 1 unless one of them is a true crossing.
  std::vector<double> frequencies;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const double low = i == 0 ? 0.5 * candidates[0] : std::sqrt(candidates[i - 1] * candidates[i]);
    const double high =
        i + 1 == candidates.size() ? 2.0 * candidates[i] : std::sqrt(candidates[i] * candidates[i + 1]);
    if ((std::abs(gain(low)) > 1.0) != (std::abs(gain(high)) > 1.0))
      frequencies.push_back(bisected(gain, low, high));
  }
  return frequencies;
}

/// The loop behind the filter as it is without a period: that of a rate at which the period no longer shows,
/// with the same density of measurement noise.
DelayedFeedback with_state_estimator(const DelayedFeedback& plant, const LinearPlant& linear,
                                     const ControlConfig& config) {
  constexpr double finer = 64.0;
  ControlConfig fine = config;
  fine.sample_rate_hz *= finer;
  StateEstimatorConfig& estimator = fine.state_estimator;
  const Plant file = read_plant_file(estimator.plant);
  const Resolution steps = resolution_of(estimator);
  estimator.cart_resolution_m = steps.cart_m * std::sqrt(finer);
  estimator.angle_resolution_rad = steps.angle_rad * std::sqrt(finer);
  const ContinuousModel model = continuous_model(file);
  const KalmanFilter::Linear filter = KalmanFilter(fine, file).linear();
  const std::vector<Index>& at = filter.present;
  const Index n = plant.a.rows(), count = static_cast<Index>(at.size()), all = n + count;
  const MatrixXd gain = filter.gain(at, Eigen::all) * fine.sample_rate_hz;
  const MatrixXd shows = linear.sensor_scale.head<2>().asDiagonal();
  const MatrixXd believes = model.sensor_scale.asDiagonal() * shown_positions()(Eigen::all, at);
  DelayedFeedback loop{MatrixXd::Zero(all, all), Eigen::VectorXd(all), Eigen::RowVectorXd::Zero(all)};
  loop.a.topLeftCorner(n, n) = plant.a;
  loop.a.block(n, 0, count, 2) = gain * shows;
  loop.a.bottomRightCorner(count, count) = MatrixXd(model.a(at, at)) - gain * believes;
  loop.b << plant.b, FilterVector(model.b * model.actuator_slope)(at);
  const Gains& k = config.gains;
  const Eigen::RowVector4d gains(k.cart_position_v_per_m, k.pendulum_angle_v_per_rad,
                                 k.cart_velocity_v_per_mps, k.pendulum_rate_v_per_radps);
  Eigen::Matrix<double, 1, filter_states> fed_back = gains * filter.fed_back;
  fed_back(filter_cart_force) = filter.rejecting_v_per_n;
  loop.k.tail(count) = fed_back(Eigen::all, at);
  return loop;
}

}  // namespace

LoopMargin continuous_margin(const Plant& plant, const ControlConfig& config, double smoothing) {
  const LinearPlant linear = linearize(plant, smoothing);
  const ControllablePart part = controllable_part(linear);
  const DelayedFeedback states{part.a, part.b * linear.actuator_slope,
                               feedback_of(linear, part, config.gains)};
  const DelayedFeedback loop =
      config.has_state_estimator() ? with_state_estimator(states, linear, config) : states;
  const LoopGain gain = [&](double w) { return transfer(loop, Complex(0.0, w)); };
  LoopMargin margin;
  margin.root_without_delay = rightmost_root(loop, linear.input_delay_s);
  margin.stable_without_delay = margin.root_without_delay.real() < -on_the_boundary_per_s;
  for (const double w : unit_gain_frequencies(loop, gain))
    margin.crossings.push_back(
        {w, delay_at(gain(w), w, linear.input_delay_s) - linear.input_delay_s, gain_falls(gain, w)});
  choose_critical(margin);
  confirm_by_roots(margin,
                   [&](double delay_s) { return rightmost_root(loop, delay_s + linear.input_delay_s); });
  return margin;
}

LoopMargin continuous_margin(const Plant& plant, const Gains& gains, double smoothing) {
  ControlConfig config;
  config.gains = gains;
  return continuous_margin(plant, config, smoothing);
}

namespace {

/// Sign changes of log |gain| over a grid that is fine against every resonance such loops have.
std::vector<std::pair<double, double>> brackets(const LoopGain& gain, double highest_radps) {
  constexpr double lowest_radps = 1e-3;
  constexpr int points = 2000;
  const double ratio = std::pow(highest_radps / lowest_radps, 1.0 / points);
  std::vector<std::pair<double, double>> found;
  double w = lowest_radps;
  bool above = std::abs(gain(w)) > 1.0;
  for (int i = 0; i < points; ++i) {
    const double next = w * ratio;
    const bool next_above = std::abs(gain(next)) > 1.0;
    if (next_above != above) found.emplace_back(w, next);
    w = next;
    above = next_above;
  }
  return found;
}

/// A crossing of the sampled loop. The delay line's interpolation takes a little of the gain where the delay
/// is not whole periods, so frequency and delay are found together.
Crossing sampled_crossing(const LinearSampledLoop& loop, std::pair<double, double> bracket) {
  const auto boundary = [&](double w) { return std::polar(1.0, w * loop.period_s()); };
  const LoopGain plain = [&](double w) { return loop.transfer(boundary(w)); };
  double w = bisected(plain, bracket.first, bracket.second);
  const bool destabilizing = gain_falls(plain, w);
  double delay = delay_at(plain(w), w, 0.0);
  constexpr int max_corrections = 30;
  for (int i = 0; i < max_corrections; ++i) {
    const LoopGain lined = [&](double v) { return plain(v) * loop.line(boundary(v), delay); };
    for (const double reach : {1e-3, 1e-2, 5e-2, 0.2}) {
      const double low = w * (1.0 - reach), high = w * (1.0 + reach);
      if ((std::abs(lined(low)) > 1.0) == (std::abs(lined(high)) > 1.0)) continue;
      w = bisected(lined, low, high);
      break;
    }
    const double correction = std::arg(lined(w)) / w;
    delay = std::max(0.0, delay + correction);
    if (std::abs(correction) < 1e-13) break;
  }
  return {w, delay, destabilizing};
}

}  // namespace

LoopMargin sampled_margin(const Plant& plant, const ControlConfig& config, double smoothing, bool confirm,
                          ExtraDelay extra) {
  const LinearSampledLoop loop(plant, config, smoothing, extra);
  LoopMargin margin;
  margin.root_without_delay = loop.rightmost_root(0.0);
  margin.stable_without_delay = margin.root_without_delay.real() < -on_the_boundary_per_s;
  const LoopGain gain = [&](double w) { return loop.transfer(std::polar(1.0, w * loop.period_s())); };
  for (const auto& bracket : brackets(gain, std::numbers::pi / loop.period_s()))
    margin.crossings.push_back(sampled_crossing(loop, bracket));
  choose_critical(margin);
  if (confirm && loop.has_roots(margin.critical_delay_s * (1.0 + aside)))
    confirm_by_roots(margin, [&](double delay_s) { return loop.rightmost_root(delay_s); });
  for (Crossing& crossing : margin.crossings) crossing.delay_s += loop.base_delay_s();
  if (margin.stable_without_delay) margin.critical_delay_s += loop.base_delay_s();
  if (margin.confirmation) {
    margin.confirmation->below_s += loop.base_delay_s();
    margin.confirmation->above_s += loop.base_delay_s();
  }
  return margin;
}

namespace {

std::string sentence_for(const OverrunTolerance& tolerance, const ControlConfig& config) {
  char text[240];
  const double delay_ms = 1e3 * config.delay_s;
  if (!tolerance.stabilized)
    std::snprintf(text, sizeof text, "the gains do not stabilize the plant, even without delay");
  else if (tolerance.exceeded() && tolerance.critical_delay_s <= 0.0)
    std::snprintf(text, sizeof text,
                  "none remains: the delay is %.4g ms, more than the gains tolerate while the cart slides",
                  delay_ms);
  else if (tolerance.exceeded())
    std::snprintf(text, sizeof text,
                  "none remains: the delay is %.4g ms, and the gains tolerate %.3g ms while the cart slides",
                  delay_ms, 1e3 * tolerance.critical_delay_s);
  else if (!std::isfinite(tolerance.extra_delay_s))
    std::snprintf(text, sizeof text,
                  "beyond the configured %.4g ms the gains tolerate any delay while the cart slides",
                  delay_ms);
  else
    std::snprintf(text, sizeof text,
                  "beyond the configured %.4g ms the gains tolerate %.3g ms more, %d consecutive missed "
                  "period%s (while the cart slides)",
                  delay_ms, 1e3 * tolerance.extra_delay_s, tolerance.missed_periods,
                  tolerance.missed_periods == 1 ? "" : "s");
  return text;
}

/// Without delay in the gain file, and without one in the plant: a delay that is too long is no fault of the
/// gains, whichever side of the loop it is on.
bool stable_without_delay(Plant plant, ControlConfig config, double smoothing) {
  plant.remove(effect_number("input_delay"));
  config.delay_s = 0.0;
  return sampled_margin(plant, config, smoothing, false).stable_without_delay;
}

}  // namespace

Plant large_motion_plant(const Plant& plant) {
  Plant large = sliding_plant(plant);
  for (std::size_t effect = 0; effect < effect_count; ++effect)
    if (is_periodic(effect)) large.remove(effect);
  return large;
}

OverrunTolerance overrun_tolerance(const Plant& plant, const ControlConfig& config) {
  constexpr double any_smoothing = 100.0;  // there is no dry friction left to smooth
  const Plant large = large_motion_plant(plant);
  const LoopMargin margin = sampled_margin(large, config, any_smoothing, false);
  OverrunTolerance tolerance;
  tolerance.stabilized = margin.stable_without_delay || stable_without_delay(large, config, any_smoothing);
  if (margin.stable_without_delay) {
    tolerance.critical_delay_s = margin.critical_delay_s;
    tolerance.extra_delay_s = std::max(0.0, margin.critical_delay_s - config.delay_s);
  }
  constexpr double max_periods = 1e6;
  const double periods = std::min(max_periods, tolerance.extra_delay_s / config.period_s());
  tolerance.missed_periods = std::max(0, static_cast<int>(std::ceil(periods - 1e-9)) - 1);
  tolerance.sentence = sentence_for(tolerance, config);
  return tolerance;
}

}  // namespace upright
