#include "upright/control/velocity_estimator.hpp"

#include <cmath>
#include <numbers>

#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"
#include "upright/model/elementary.hpp"

namespace upright {

namespace {

/// exp(A t) of A = [[0, 1], [-wc^2, -2 zeta wc]], and the response of (position, velocity) to a unit ramp x =
/// t / T.
EstimatorStep second_order_step(double wc, double zeta, double period) {
  // Both responses are c(t) and s(t), the solutions of y'' + 2 zeta wc y' + wc^2 y = 0 with s(0) = 0, s'(0) =
  // 1 and c = s' + 2 zeta wc s, so that one formula serves under-, over- and critically damped filters.
  const double decay = zeta * wc;
  const double disc = (zeta - 1.0) * (zeta + 1.0) * wc * wc;
  const double root = std::sqrt(std::abs(disc));
  double s = 0.0, s_rate = 0.0;
  constexpr double nearly_critical = 1e-4;
  if (root * period < nearly_critical) {
    // sinh(u)/u and cosh(u) about u = 0; the next terms are below 1e-17.
    const double u2 = disc * period * period;
    const double fade = elementary::exp(-decay * period);
    s = fade * period * (1.0 + u2 / 6.0);
    s_rate = fade * (1.0 + u2 / 2.0) - decay * s;
  } else if (disc > 0.0) {
    // Written with both roots, so that a large damping does not overflow.
    const double slow = elementary::exp((root - decay) * period),
                 fast = elementary::exp(-(root + decay) * period);
    s = (slow - fast) / (2.0 * root);
    s_rate = 0.5 * (slow + fast) - decay * s;
  } else {
    const double fade = elementary::exp(-decay * period);
    const auto [sine, cosine] = elementary::sine_and_cosine(root * period);
    s = fade * sine / root;
    s_rate = fade * cosine - decay * s;
  }
  EstimatorStep step;
  step.p11 = s_rate + 2.0 * decay * s;
  step.p12 = s;
  step.p21 = -wc * wc * s;
  step.p22 = s_rate;
  // A ramp of slope 1/T from rest: filtered position lags by 2 zeta / wc times the slope once settled.
  const double settled_lag = 2.0 * zeta / wc;
  const double slope = 1.0 / period;
  step.g1 = slope * (settled_lag * (step.p11 - 1.0) - s);
  step.g2 = slope * (1.0 + settled_lag * step.p21 - s_rate);
  return step;
}

}  // namespace

EstimatorStep make_estimator_step(const EstimatorConfig& config, double period_s) {
  if (!(period_s > 0.0) || !std::isfinite(period_s))
    throw ConfigError("the sampling period is " + exact_text(period_s) + " s: use a value above 0");
  if (config.kind != EstimatorKind::second_order_filter) {
    EstimatorStep step;
    step.g2 = 1.0 / period_s;
    return step;
  }
  if (!(config.cutoff_hz > 0.0) || !(config.damping > 0.0) || !std::isfinite(config.cutoff_hz) ||
      !std::isfinite(config.damping))
    throw ConfigError("cutoff frequency and damping of the velocity filter are " +
                      exact_text(config.cutoff_hz) + " Hz and " + exact_text(config.damping) +
                      ": set both to a value above 0");
  return second_order_step(2.0 * std::numbers::pi * config.cutoff_hz, config.damping, period_s);
}

}  // namespace upright
