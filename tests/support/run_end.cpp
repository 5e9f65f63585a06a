#include "run_end.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

namespace upright::test {

namespace {

/// The value of a key of run.yaml's outcome; empty: it has none.
std::string outcome_value(const std::string& yaml, const std::string& key) {
  const std::string line = "\n  " + key + ": ";
  const std::size_t outcome = yaml.find("\noutcome:");
  const std::size_t at = outcome == std::string::npos ? outcome : yaml.find(line, outcome);
  if (at == std::string::npos) return "";
  const std::size_t begin = at + line.size();
  return yaml.substr(begin, yaml.find('\n', begin) - begin);
}

}  // namespace

bool RunEnd::of_timing() const {
  return reason == "overrun" || reason == "stale_encoder" || reason == "link_lost";
}

Interval RunEnd::before() const {
  // The watchdog time of the rigs under test, after which a link or an encoder is lost, and the few late
  // periods after which a run stops.
  constexpr double watchdog_s = 0.1, few_periods_s = 0.05;
  return {stopped_s - watchdog_s - few_periods_s, stopped_s};
}

std::optional<RunEnd> run_end(const std::string& run_yaml) {
  RunEnd end;
  end.reason = outcome_value(run_yaml, "reason");
  if (end.reason.empty()) return std::nullopt;
  end.stopped_s = std::stod(outcome_value(run_yaml, "started_monotonic_s")) +
                  std::stod(outcome_value(run_yaml, "time_s"));
  return end;
}

void expect_no_late_end(const std::filesystem::path& folder) {
  std::error_code none;
  if (!std::filesystem::exists(folder, none)) return;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().filename() != "run.yaml") continue;
    std::ifstream in(entry.path());
    const std::string yaml{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    const std::optional<RunEnd> end = run_end(yaml);
    if (end && end->of_timing()) EXPECT_END(*end, false);
  }
}

void expect_end(const RunEnd& end, bool is_right, const char* file, int line) {
  if (end.of_timing())
    expect_timing(end.before(), is_right, "the end is as expected", "the run ended with " + end.reason, file,
                  line);
  else if (!is_right)
    ADD_FAILURE_AT(file, line) << "the run ended with " << end.reason;
}

}  // namespace upright::test
