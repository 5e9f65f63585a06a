// What a run with a fault leaves behind, on the plant's side and in its directory, and how it is judged.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "../integration/virtual_rig_process.hpp"
#include "fault_table.hpp"

namespace upright::test {

/// What the plant was given and where it was, by its own record.
struct PlantRow {
  double time_s = 0.0, voltage_v = 0.0, cart_m = 0.0;
};

std::vector<PlantRow> plant_rows(const std::vector<TraceRow>& trace);

struct Evidence {
  std::vector<PlantRow> plant;
  double fault_s = 0.0;  ///< when the fault began, on the plant's clock
  std::filesystem::path run;
  bool replays = true;       ///< false: the fault is in the controller itself
  bool log_may_end = false;  ///< true: the fault is in the log, whose last rows may be missing
};

/// The reason in run.yaml.
std::string reason_of(const Evidence& evidence);

/// True when the run ended too late, or in a way that is not expected but that a machine too busy for it
/// brings about: worth another attempt.
bool machine_was_too_busy(const Evidence& evidence, const Expectation& expectation);

/// The motor was on; the run ended as expected; zero volts in time and for good; the cart stayed on the
/// track; the log is whole and replays.
void judge(const Evidence& evidence, const Expectation& expectation);

}  // namespace upright::test
