// What a run with a fault leaves behind, on the plant's side and in its directory, and how it is judged.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
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

/// When the last row of a run's log was written, on the monotonic clock.
double log_end_s(const std::filesystem::path& run);

/// What attempts come to that give nothing: each run was over before it was put to the test.
inline constexpr const char* never_came_about =
    "the run does not begin, or ends before its fault comes about";

/// The first result that `is_good`, on a machine that may be too busy for it, or the last of several
/// attempts.
template <class Attempt, class IsGood>
auto tried(const Attempt& attempt, const IsGood& is_good) {
  constexpr int more_attempts = 4;
  auto result = attempt();
  for (int i = 0; i < more_attempts && !(result && is_good(*result)); ++i) result = attempt();
  return result;
}
template <class Attempt>
auto tried(const Attempt& attempt) {
  return tried(attempt, [](const auto&) { return true; });
}

/// The motor was on; the run ended as expected; zero volts in time and for good; the cart stayed on the
/// track; the log is whole and replays.
void judge(const Evidence& evidence, const Expectation& expectation);

/// Judges what the first attempt leaves that ends neither too late nor in a way that is not expected but that
/// a machine too busy for it brings about, or else the last.
void judge_attempts(const std::function<std::optional<Evidence>()>& attempt, const Expectation& expectation);

}  // namespace upright::test
