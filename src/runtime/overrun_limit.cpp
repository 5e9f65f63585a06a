#include "overrun_limit.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "upright/base/error.hpp"
#include "upright/runtime/session.hpp"

namespace upright {

namespace {

/// The tightest limit [periods]: an ordinary kernel's hiccup makes as many, so that a tighter one would stop
/// loops that nothing is wrong with.
constexpr std::uint64_t tightest_periods = 3;

/// What a loop is taken to bear where there is no model [s]: less than a tenth of what the best PD controller
/// bears on a pendulum of 0.1 m, the shortest that is balanced (0.12 s: Stepan, Retarded Dynamical Systems,
/// 1989).
constexpr double unknown_tolerance_s = 0.010;

std::uint64_t unknown_limit(double period_s) {
  return std::max(tightest_periods, static_cast<std::uint64_t>(std::ceil(unknown_tolerance_s / period_s)));
}

/// Not more than leaves time before a fall, whatever the linear loop bears.
std::uint64_t limit_for(const OverrunTolerance& tolerance, double period_s) {
  const auto tolerated = static_cast<std::uint64_t>(tolerance.missed_periods);
  return std::min(std::max(tightest_periods, tolerated), default_periods_late(period_s));
}

std::string milliseconds(double seconds, const char* format) {
  char text[32];
  std::snprintf(text, sizeof text, format, 1e3 * seconds);
  return std::string(text) + " ms";
}

std::string warning_for(const OverrunTolerance& tolerance, const Plant& plant, const ControlConfig& control) {
  if (!tolerance.exceeded()) return "";
  const std::string loud = "THE LOOP WILL OSCILLATE OR FALL: ";
  if (!tolerance.stabilized)
    return loud + "the gains do not stabilize this plant, even without delay; check their signs and design";
  std::string text = loud + "its delay of " + milliseconds(control.delay_s, "%.4g");
  if (const PlantEffect* own = plant.find("input_delay"))
    text += " in addition to the plant's own " + milliseconds(own->values[0], "%.4g");
  if (tolerance.critical_delay_s > 0.0)
    text += " exceeds the " + milliseconds(tolerance.critical_delay_s, "%.3g") +
            " that the gains tolerate while the cart slides";
  else
    text += " is more than the gains tolerate while the cart slides";
  return text + "; reduce the delay or design gains for it (see upright margin and upright design)";
}

}  // namespace

OverrunLimit overrun_limit(const std::optional<Plant>& model, const ControlConfig& control) {
  OverrunLimit limit;
  if (model && model->pendulum) {
    limit.tolerance = overrun_tolerance(*model, control);
    limit.max_periods_late = limit_for(*limit.tolerance, control.period_s());
    limit.sentence = limit.tolerance->sentence;
    limit.warning = warning_for(*limit.tolerance, *model, control);
  } else {
    limit.max_periods_late = unknown_limit(control.period_s());
    limit.sentence = "unknown without a model of the rig (--plant), assumed to be " +
                     milliseconds(unknown_tolerance_s, "%.4g");
  }
  limit.sentence += "; the run stops when more than " + std::to_string(limit.max_periods_late) +
                    " periods in a row overrun";
  return limit;
}

void apply(const OverrunLimit& overrun, LoopLimits& limits) {
  limits.max_periods_late = overrun.max_periods_late;
  limits.delay_exceeded = !overrun.warning.empty();
}

void require_stabilized(const OverrunLimit& limit, const std::string& gains) {
  if (!limit.tolerance || limit.tolerance->stabilized) return;
  throw ConfigError(
      gains +
      " do not stabilize the plant, even without delay: check their signs and that they were designed for "
      "this plant, design others with upright design, or give --force");
}

}  // namespace upright
