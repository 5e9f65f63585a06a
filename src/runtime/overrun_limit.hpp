// How many periods in a row may be late before a loop is stopped. `run` and `experiment` have the same rule.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "control_loop.hpp"
#include "design/delay_margin.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

struct OverrunLimit {
  std::uint64_t max_periods_late = 0;         ///< for LoopLimits
  std::optional<OverrunTolerance> tolerance;  ///< none: there is no model of a pendulum to find it from
  std::string sentence;  ///< the delay that the loop tolerates, and the limit that follows
  std::string warning;   ///< one sentence where the loop will oscillate or fall; else empty
};

/// From the delay that the gains tolerate at the delay of `control` on `model`, which is none where the rig
/// is unknown. Throws ConfigError.
OverrunLimit overrun_limit(const std::optional<Plant>& model, const ControlConfig& control);

/// Puts what is known of a loop into its limits: how many late periods it tolerates, and that its delay is
/// beyond what the plant tolerates, which the sentence of its end then names.
void apply(const OverrunLimit& overrun, LoopLimits& limits);

/// Throws ConfigError for gains that cannot hold the model's pendulum, even without delay. A delay that is
/// too long for them is only warned of, for delays are what is studied. `gains` begins the sentence.
void require_stabilized(const OverrunLimit& limit, const std::string& gains = "the gains");

}  // namespace upright
