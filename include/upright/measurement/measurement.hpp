// Measured runs for diagnosis and identification: a run directory, a CSV, or a dataset file that maps a
// foreign CSV.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace upright {

struct Dataset;

/// From a sample on, so much was added to the angle because it had been folded into one turn.
struct Unfolding {
  std::size_t from = 0;
  double added_rad = 0.0;
};

/// One run: encoders were read at time_s[k], then voltage_v[k] was commanded and held until time_s[k + 1].
struct Measurement {
  std::string name;
  std::vector<double> time_s;
  std::vector<double> voltage_v;
  std::vector<double> cart_m;     ///< empty: not measured
  std::vector<double> theta_rad;  ///< empty: not measured; unwrapped, 0 upright
  bool cart_locked = false;
  double cart_resolution_m = 0.0;     ///< 0: no steps are visible
  double theta_resolution_rad = 0.0;  ///< 0: no steps are visible
  /// How much of a measurement each sample is: quantised values that stay the same are not new each time.
  /// Empty: all whole.
  std::vector<double> cart_weight, theta_weight;
  /// What cart_noise_m() and theta_noise_rad() found when the run was read; they look at every sample
  /// otherwise.
  std::optional<double> known_cart_noise_m, known_theta_noise_rad;
  std::vector<std::size_t> breaks;  ///< samples before which rows are missing: nothing is followed across
  std::vector<Unfolding> unfoldings;
  std::shared_ptr<const Dataset> dataset;  ///< how it was read; none if it was not read from a file
  std::size_t missing_rows = 0;            ///< rows of the file without a number in a cell
  std::vector<std::string> notes;          ///< what was found and assumed while reading

  std::size_t size() const { return time_s.size(); }
  bool has_cart() const { return !cart_m.empty(); }
  bool has_theta() const { return !theta_rad.empty(); }
  double median_period_s() const;
  /// Standard deviation of the sensor noise that the data themselves show: quantisation and what lies above
  /// it.
  double cart_noise_m() const;
  double theta_noise_rad() const;
};

/// Reads one item of `--data`. Throws ConfigError with remedy, file and line for everything that cannot be
/// used: no common columns, one sample, constant data, text for a number, time that does not grow.
Measurement read_measurement(const std::filesystem::path& path);

/// Reads all items of `--data`. A run in which nothing moves says nothing of the model, and may be an encoder
/// that is not connected: beside runs that move it is left out, which is noted.
std::vector<Measurement> read_measurements(const std::vector<std::filesystem::path>& paths);

/// The step of quantised values: the largest number of which all differences are multiples; 0 when there is
/// none.
double find_resolution(const std::vector<double>& values);

/// The weight of each sample of quantised values. The error of a quantised value is as good as new whenever
/// the signal has crossed a step. While it dwells in one it stays: where the signal turns around, all samples
/// of the dwell count as one; where it lingers, as many as it would have had at the speed before and after.
std::vector<double> dwell_weights(const std::vector<double>& values);

/// Standard deviation of white noise under a smooth signal, from fourth differences.
double find_noise(const std::vector<double>& values);

}  // namespace upright
