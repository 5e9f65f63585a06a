// What a run with a fault leaves behind, on the plant's side and in its directory, and how it is judged.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "../integration/virtual_rig_process.hpp"
#include "fault_table.hpp"
#include "tests/support/real_time.hpp"

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

/// Asserts, as a matter of timing, that a run came so far that its fault came about. `runs` is the folder of
/// its directory, where it has one.
void expect_came_about(bool came, const Since& begin, const std::filesystem::path& runs);

/// What `run` gives; nothing is a failure.
template <class Run>
auto came_about(const std::filesystem::path& runs, const Run& run) {
  const Since begin;
  auto result = run();
  expect_came_about(result.has_value(), begin, runs);
  return result;
}

/// The motor was on; the run ended as expected; zero volts in time and for good; the cart stayed on the
/// track; the log is whole and replays. How it ended is a matter of timing where it ended for being late, or
/// for a link or encoders that are late; so is when the voltage was zero.
void judge(const Evidence& evidence, const Expectation& expectation);

/// A case of the suite: makes the attempt in real time, and keeps the table's cell once it has passed.
void fault_case(const std::string& fault, Bench bench, const std::string& cell,
                const std::function<void()>& attempt);

}  // namespace upright::test
