// How a run behaved over its last third, where the start is forgotten: hunting, voltage, chatter, falls,
// lateness; each with an interval, so that two runs can be told apart from chance.
//
// Intervals hold with 95 percent, from batches of equal duration (at least a second each, 5 to 20 of them)
// and without any random number. A root mean square has Student's interval of the batches' mean squares;
// where neighbouring batches resemble each other it is widened by (1 + r) / (1 - r) of the variance, r the
// correlation of neighbours. A peak-to-peak value scatters as that of one batch does: the largest of several
// has the spread of the largest of one (exactly so for Gumbel's law).
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

/// A value; without an interval where the run is too short for one.
struct Estimate {
  double value = 0.0;
  std::optional<std::array<double, 2>> ci95;
};

/// The quantities by which runs are compared, in the order of `quantities`.
struct Behaviour {
  std::array<Estimate, 4> values;
};

/// Names as in JSON, SI units; and how people read them.
struct Quantity {
  std::string_view key, name, unit;
  double per_si_unit;  ///< a value in `unit` is this times the SI value
};
inline constexpr std::array<Quantity, 4> quantities = {
    {{"cart_peak_to_peak_m", "cart", "mm peak to peak", 1e3},
     {"theta_peak_to_peak_rad", "angle", "deg peak to peak", 57.29577951308232},
     {"voltage_rms_v", "voltage", "V rms", 1.0},
     {"voltage_step_rms_v", "voltage from step to step", "V rms", 1.0}}};

/// Measures rows between two times, in the same memory however many there are.
class BehaviourMeter {
 public:
  /// The window must not be empty.
  BehaviourMeter(double from_s, double to_s);

  /// Rows in their order; those before the window give the first step's voltage.
  void add(const LogRecord& row);
  /// None when the window is too short or holds too few rows.
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
  std::string result;               ///< completed, fell, stopped, or cut_short where no outcome was written
  std::string sentence;             ///< why the run ended, as it said itself
  double ended_s = 0.0;
  bool fell = false;
  std::optional<Behaviour> behaviour;  ///< none: see `problem`
  std::string problem;
  /// Of the last third; none in virtual time.
  struct Lateness {
    double median_us, p99_us, largest_us;
  };
  std::optional<Lateness> lateness;
};

/// Reads a run, also one that was cut short, with any sample rate. Where the log tells when the state
/// feedback acts (experiments), only those rows count. Throws ConfigError when the folder is no run.
RunBehaviour behaviour_of_run(const std::filesystem::path& directory);

/// One quantity of two runs.
struct Difference {
  std::size_t quantity = 0;  ///< place in `quantities`
  double from = 0.0, to = 0.0;
  /// Told apart from chance by the intervals; none where one of the runs has none.
  std::optional<bool> is_clear;
};

/// The largest ratio first, clear ones before the others; empty where one has no behaviour.
std::vector<Difference> differences_between(const RunBehaviour& before, const RunBehaviour& after);

}  // namespace upright
