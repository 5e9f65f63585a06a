#include "attached_start.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "model/dense_algebra.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

namespace {

/// Deflection q from the cart, and the absolute speed w of the mass. With w = dq/dt + v no acceleration of
/// the cart is needed, which measured positions hardly show.
struct Swing {
  double q_m, w_mps;
};

/// The equations of AttachedMass on a cart: dq/dt = w - v, dw/dt = -(stiffness q + damping dq/dt).
class SprungMassMotion {
 public:
  explicit SprungMassMotion(const Dynamics<double>& dynamics) {
    const AttachedMass<double, EffectSet> mass(dynamics.model(), dynamics.model().present, dynamics.base());
    stiffness_per_s2_ = mass.pull_mps2(dynamics.model(), 1.0, 0.0);
    damping_per_s_ = mass.pull_mps2(dynamics.model(), 0.0, 1.0);
  }

  /// How long it remembers a motion, to 1e-4 of it; infinite without damping.
  double memory_s() const {
    constexpr double forgotten = 9.2;
    const double half = 0.5 * damping_per_s_, square = half * half - stiffness_per_s2_;
    return forgotten / (square > 0.0 ? half - std::sqrt(square) : half);
  }

  /// Its motion on a cart of this mean speed.
  void advance(double cart_mps, double period_s, Swing& swing) const {
    constexpr double longest_step = 0.5;  // of the fastest time constant: Runge-Kutta errs by 1e-3 in phase
    constexpr double most_steps = 1e4;
    const double fastest_per_s = std::sqrt(stiffness_per_s2_) + damping_per_s_;
    const double steps = std::clamp(std::ceil(fastest_per_s * period_s / longest_step), 1.0, most_steps);
    const double h = period_s / steps;
    const auto rate_of = [&](const Swing& at) {
      const double rate = at.w_mps - cart_mps;
      return Swing{rate, -(stiffness_per_s2_ * at.q_m + damping_per_s_ * rate)};
    };
    const auto moved = [&](const Swing& rate, double time_s) {
      return Swing{swing.q_m + rate.q_m * time_s, swing.w_mps + rate.w_mps * time_s};
    };
    for (double step = 0.0; step < steps; ++step) {
      const Swing a = rate_of(swing), b = rate_of(moved(a, 0.5 * h));
      const Swing c = rate_of(moved(b, 0.5 * h)), d = rate_of(moved(c, h));
      swing.q_m += h / 6.0 * (a.q_m + 2.0 * (b.q_m + c.q_m) + d.q_m);
      swing.w_mps += h / 6.0 * (a.w_mps + 2.0 * (b.w_mps + c.w_mps) + d.w_mps);
    }
  }

 private:
  double stiffness_per_s2_ = 0.0, damping_per_s_ = 0.0;
};

/// The speed that is shown at the beginning of a run [m/s]: of a cubic through the first samples, since the
/// voltage may begin with a step. 0 where noise accounts for it.
double initial_speed_mps(const Measurement& run) {
  constexpr double window_s = 0.03, standard_errors = 3.0;
  constexpr std::size_t least_samples = 6;
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d score = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < run.size(); ++i) {
    const double u = (run.time_s[i] - run.time_s[0]) / window_s;
    if (i >= least_samples && u > 1.0) break;
    const Eigen::Vector4d basis(1.0, u, u * u, u * u * u);
    information += basis * basis.transpose();
    score += basis * (run.cart_m[i] - run.cart_m[0]);
  }
  const Eigen::MatrixXd covariance = inverse(information);
  const double slope = covariance.row(1).dot(score);
  const double error = run.cart_noise_m() * std::sqrt(covariance(1, 1));
  return std::abs(slope) > standard_errors * error ? slope / window_s : 0.0;
}

/// Mean speed of the cart without its sign, as shown [m/s].
double usual_speed_mps(const Measurement& run) {
  double way_m = 0.0;
  for (std::size_t k = 1; k < run.size(); ++k) way_m += std::abs(run.cart_m[k] - run.cart_m[k - 1]);
  return way_m / (run.time_s.back() - run.time_s.front());
}

bool begins_at_rest(const Measurement& run) {
  constexpr double little = 0.1;  // of the usual speed: a cubic errs by a part of it
  return std::abs(initial_speed_mps(run)) <= little * usual_speed_mps(run);
}

/// The sample after the last gap before a sample, or the first one of the run.
std::size_t begin_of_motion(const Measurement& run, std::size_t end) {
  const double mean_period_s = (run.time_s.back() - run.time_s.front()) / static_cast<double>(run.size());
  std::size_t begin = end;
  while (begin > 0 && !is_gap(run, begin, mean_period_s)) --begin;
  return begin;
}

}  // namespace

bool is_driven_by_cart(std::size_t effect) {
  bool is_driven = false;
  for_each_effect([&]<std::size_t I>() {
    using E = EffectAt<I>;
    if constexpr (has_attached_mass<E, double> && !has_bending_rod<E, double>)
      is_driven = is_driven || (I == effect && !E::motor_is_attached);
  });
  return is_driven;
}

bool is_driven_by_cart(const Plant& plant) {
  return std::ranges::any_of(plant.effects,
                             [](const PlantEffect& effect) { return is_driven_by_cart(effect.number); });
}

MotionBefore::MotionBefore(const Measurement& run, const Segment& segment)
    : run_(run), begin_(segment.first), end_(segment.first) {
  // A usual chain (3 Hz, damping ratio 0.05) has lost 94 % of a swing after this time.
  constexpr double settles_within_s = 3.0;
  if (!run.has_cart()) return;
  begin_ = begin_of_motion(run, end_);
  const bool is_recent = run.time_s[end_] - run.time_s[begin_] < settles_within_s;
  is_known_ = !is_recent || (begin_ == 0 && begins_at_rest(run));
}

PlantState<double> MotionBefore::with_mass(const Plant& plant, PlantState<double> start) const {
  if (!is_known_) return start;
  if (is_empty()) {
    start.attached_m = start.attached_mps = 0.0;
    return start;
  }
  const PlantModel<double> model = make_model<double>(plant);
  const Dynamics<double> dynamics(model);
  const SprungMassMotion motion(dynamics);
  const double gain = SensorLine<double>(model).cart_gain, memory_s = motion.memory_s();
  std::size_t k = end_;
  while (k > begin_ && run_.time_s[end_] - run_.time_s[k] < memory_s) --k;
  Swing swing{0.0, 0.0};
  for (; k < end_; ++k) {
    const double period_s = run_.time_s[k + 1] - run_.time_s[k];
    motion.advance((run_.cart_m[k + 1] - run_.cart_m[k]) / (gain * period_s), period_s, swing);
  }
  const double ahead_m = (run_.cart_m[end_] - dynamics.measure(start).cart_m) / gain;
  start.attached_m = swing.q_m + ahead_m;
  start.attached_mps = swing.w_mps - start.cart_mps;
  return start;
}

}  // namespace upright
