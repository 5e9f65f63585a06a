#include "widened_margin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlopt.hpp>
#include <numbers>
#include <vector>

#include "delay_margin.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

/// Logarithms of the factors by which the four gains and the force noise differ from the start's.
using Factors = std::vector<double>;

/// A factor of at most twenty either way: the search ends at the cost long before.
constexpr double max_log_factor = 3.0;
constexpr double first_step = 0.1;
constexpr double tolerance = 1e-3;    ///< of a factor's logarithm
constexpr int max_evaluations = 300;  ///< of one search
/// A search begins again from its result, with large steps, until that gains less than this share.
constexpr double worth_another_search = 0.01;

std::array<double, 4> gain_values(const ControlConfig& config) {
  const Gains& k = config.gains;
  return {k.cart_position_v_per_m, k.pendulum_angle_v_per_rad, k.cart_velocity_v_per_mps,
          k.pendulum_rate_v_per_radps};
}

class MarginSearch {
 public:
  MarginSearch(const Plant& plant, const MarginRequest& request, const ControlConfig& start)
      : plant_(plant),
        request_(request),
        start_(start),
        cost_(plant, request.weights, request.smoothing, start.sample_rate_hz) {}

  /// The best of all evaluated; empty where none is allowed.
  Factors run() {
    // Without delay the start is allowed, or nearly so; with it, the search may begin where the loop is
    // unstable.
    const double delay_s = start_.delay_s;
    start_.delay_s = 0.0;
    const Factors first = repeated_search(Factors(variables(), 0.0));
    if (delay_s == 0.0 || first.empty()) return first;
    start_.delay_s = delay_s;
    last_.clear();
    best_.clear();
    largest_s_ = 0.0;
    return repeated_search(with_reserve(first));
  }

  ControlConfig config_of(const Factors& factors) const {
    ControlConfig config = start_;
    Gains& k = config.gains;
    k.cart_position_v_per_m *= std::exp(factors[0]);
    k.pendulum_angle_v_per_rad *= std::exp(factors[1]);
    k.cart_velocity_v_per_mps *= std::exp(factors[2]);
    k.pendulum_rate_v_per_radps *= std::exp(factors[3]);
    if (estimates()) *config.state_estimator.cart_force_noise_n2_per_s *= std::exp(factors[4]);
    return config;
  }
  const GainCost& cost() const { return cost_; }
  double critical_of(const ControlConfig& config) const {
    const LoopMargin margin = sampled_margin(plant_, config, request_.smoothing, false);
    return margin.stable_without_delay ? margin.critical_delay_s : 0.0;
  }

 private:
  struct Evaluation {
    double critical_s = 0.0;
    double reserve_s = 0.0;    ///< of unmodelled delay; negative where the loop is unstable
    double excess_loss = 0.0;  ///< of the cost, beyond the allowed one
  };

  /// `factors` with as much less force noise as the reserve of unmodelled delay needs.
  Factors with_reserve(Factors factors) {
    constexpr int max_halvings = 12;
    for (int i = 0; estimates() && i < max_halvings && missing_reserve_s(factors) > 0.0; ++i)
      factors.back() -= std::numbers::ln2;
    return factors;
  }

  Factors repeated_search(Factors from) {
    for (double before_s = 0.0;; before_s = largest_s_) {
      search_from(from);
      if (largest_s_ <= before_s * (1.0 + worth_another_search)) return best_;
      from = best_;
    }
  }

  void search_from(Factors start) {
    nlopt::opt search(nlopt::LN_COBYLA, static_cast<unsigned>(variables()));
    search.set_lower_bounds(-max_log_factor);
    search.set_upper_bounds(max_log_factor);
    search.set_initial_step(first_step);
    search.set_xtol_abs(tolerance);
    search.set_maxeval(max_evaluations);
    search.set_max_objective(
        [](const Factors& factors, Factors&, void* self) {
          return static_cast<MarginSearch*>(self)->evaluate(factors).critical_s;
        },
        this);
    search.add_inequality_constraint(
        [](const Factors& factors, Factors&, void* self) {
          return static_cast<MarginSearch*>(self)->evaluate(factors).excess_loss;
        },
        this);
    if (estimates())
      search.add_inequality_constraint(
          [](const Factors& factors, Factors&, void* self) {
            return static_cast<MarginSearch*>(self)->missing_reserve_s(factors);
          },
          this);
    double largest_s = 0.0;
    try {
      search.optimize(start, largest_s);
    } catch (const nlopt::roundoff_limited&) {  // the best so far is kept in any case
    }
  }

  bool estimates() const { return start_.has_state_estimator(); }
  std::size_t variables() const { return estimates() ? 5 : 4; }

  double missing_reserve_s(const Factors& factors) {
    return request_.unmodelled_s - evaluate(factors).reserve_s;
  }

  const Evaluation& evaluate(const Factors& factors) {
    if (factors == last_) return found_;
    last_ = factors;
    const ControlConfig config = config_of(factors);
    found_.critical_s = critical_of(config);
    found_.reserve_s = found_.critical_s - config.delay_s;
    if (estimates() && found_.reserve_s > 0.0) {
      const LoopMargin margin =
          sampled_margin(plant_, config, request_.smoothing, false, ExtraDelay::unmodelled);
      found_.reserve_s = margin.stable_without_delay ? margin.critical_delay_s - config.delay_s : 0.0;
    }
    constexpr double far = 1e3;  // in the place of infinite, which the linear models of COBYLA cannot take
    found_.excess_loss = std::min(cost_.loss(gain_values(config)), far) - request_.cost_loss;
    const bool allowed = found_.excess_loss <= 0.0 && found_.reserve_s >= request_.unmodelled_s;
    if (allowed && found_.critical_s > largest_s_) {
      largest_s_ = found_.critical_s;
      best_ = factors;
    }
    return found_;
  }

  const Plant& plant_;
  const MarginRequest& request_;
  ControlConfig start_;
  GainCost cost_;
  Factors last_, best_;
  Evaluation found_;
  double largest_s_ = 0.0;
};

}  // namespace

WidenedMargin widen_margin(const Plant& plant, const MarginRequest& request, ControlConfig& config) {
  MarginSearch search(plant, request, config);
  WidenedMargin widened;
  widened.lqr_critical_s = search.critical_of(config);
  const Factors best = search.run();
  if (best.empty())
    throw ConfigError("no gains were found that cost at most " + exact_text(100.0 * request.cost_loss) +
                      " percent more than the optimal ones and hold the plant with a delay of " +
                      exact_text(1e3 * config.delay_s) +
                      " ms: raise --cost-loss, or design a predictor with --delay");
  config = search.config_of(best);
  widened.cost_loss = search.cost().loss(gain_values(config));
  widened.critical_s = search.critical_of(config);
  widened.gains = gain_values(config);
  widened.closed_loop_poles = search.cost().closed_loop_poles(widened.gains);
  return widened;
}

void adopt(const WidenedMargin& widened, GainDesign& design) {
  design.gains = widened.gains;
  design.closed_loop_poles = widened.closed_loop_poles;
}

}  // namespace upright
