// The behaviour of a run over its last third, after the transient: hunting, voltage, chatter, falls and
// lateness, with confidence intervals to compare runs.
//
// The 95 % intervals come from batches of equal duration (5 to 20 of at least a second each), without random
// numbers. An RMS value has Student's interval of the batches' mean squares. If neighbouring batches are
// correlated with r, the variance is multiplied by (1 + r) / (1 - r). A peak-to-peak value has the scatter of
// one batch, because the largest of several values has the spread of a single one (exactly for the Gumbel
// distribution).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "upright/record/log_record.hpp"
#include "upright/record/timing_stats.hpp"

namespace upright {

/// A value with a 95 % interval, or without one if the run is too short.
struct Estimate {
  double value = 0.0;
  std::optional<std::array<double, 2>> ci95;
};

/// The quantities by which runs are compared, in the order of `quantities`.
struct Behaviour {
  std::array<Estimate, 4> values;
};

/// The key in JSON (SI units), and name, unit and factor for display.
struct Quantity {
  std::string_view key, name, unit;
  double per_si_unit;  ///< a value in `unit` is this times the SI value
};
inline constexpr std::array<Quantity, 4> quantities = {
    {{"cart_peak_to_peak_m", "cart", "mm peak to peak", 1e3},
     {"theta_peak_to_peak_rad", "angle", "deg peak to peak", 57.29577951308232},
     {"voltage_rms_v", "voltage", "V rms", 1.0},
     {"voltage_step_rms_v", "voltage change per sample", "V rms", 1.0}}};

/// Measures rows between two times, in constant memory.
class BehaviourMeter {
 public:
  /// The window must not be empty.
  BehaviourMeter(double from_s, double to_s);

  /// Rows in order. Rows before the window give the voltage before the first change.
  void add(const LogRecord& row);
  /// Empty if the window is too short or has too few rows.
  std::optional<Behaviour> result() const;
  std::uint64_t rows() const { return rows_; }
  const DurationHistogram& lateness() const { return lateness_; }

 private:
  struct Batch {
    double low_cart_m, high_cart_m, low_theta_rad, high_theta_rad;
    double voltage_squares = 0.0, step_squares = 0.0;
    std::uint64_t rows = 0;
  };

  double from_s_, to_s_;
  std::vector<Batch> batches_;
  std::optional<double> last_voltage_v_;
  std::uint64_t rows_ = 0;
  DurationHistogram lateness_;
};

struct RunBehaviour {
  std::filesystem::path run;
  std::string name;
  double sample_rate_hz = 0.0;
  double from_s = 0.0, to_s = 0.0;  ///< the last third
  std::uint64_t rows = 0;           ///< in it
  std::string result;               ///< completed, fell, stopped, or cut_short if no outcome was written
  std::string sentence;             ///< why the run ended, from its outcome
  double ended_s = 0.0;
  bool fell = false;
  std::optional<Behaviour> behaviour;  ///< empty: see `problem`
  std::string problem;
  /// Of the last third. Empty in virtual time.
  struct Lateness {
    double median_us, p99_us, largest_us;
  };
  std::optional<Lateness> lateness;
};

/// Reads a run with any sample rate, also one that was cut short. If the log marks when the state feedback
/// acts (experiments), only those rows count. Throws ConfigError if the folder is not a run.
RunBehaviour behaviour_of_run(const std::filesystem::path& directory);

/// One quantity of two runs.
struct Difference {
  std::size_t quantity = 0;  ///< place in `quantities`
  double from = 0.0, to = 0.0;
  /// Whether the difference exceeds the intervals. Empty if one of the runs has none.
  std::optional<bool> is_clear;
};

/// Clear differences first, then by ratio. Empty if one of the runs has no behaviour.
std::vector<Difference> differences_between(const RunBehaviour& before, const RunBehaviour& after);

}  // namespace upright
