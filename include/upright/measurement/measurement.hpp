// Measured runs for diagnosis and identification, from a run directory, a CSV file, or a dataset file
// that describes a foreign CSV file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace upright {

struct Dataset;

/// A voltage that is held from a time until the next command.
struct VoltageCommand {
  double time_s = 0.0;     ///< when it was commanded [s]
  double voltage_v = 0.0;  ///< [V]
};

/// From sample `from` on, `added_rad` was added to unwrap an angle that was recorded modulo a turn.
struct Unfolding {
  std::size_t from = 0;    ///< the sample from which it applies
  double added_rad = 0.0;  ///< what was added to the angle [rad]
};

/// One run: encoders are read at time_s[k]; voltage_v[k] is held from then until time_s[k + 1].
struct Measurement {
  std::string name;                   ///< for messages
  std::vector<double> time_s;         ///< increasing [s]
  std::vector<double> voltage_v;      ///< held until the next sample [V]
  std::vector<double> cart_m;         ///< empty: not measured
  std::vector<double> theta_rad;      ///< empty: not measured; unwrapped, 0 upright
  bool cart_locked = false;           ///< the cart was held: only the pendulum swings
  double cart_resolution_m = 0.0;     ///< 0: no quantisation found
  double theta_resolution_rad = 0.0;  ///< 0: no quantisation found
  /// Weight of each sample as a measurement: repeated quantised values carry less information. Empty: all
  /// 1.
  std::vector<double> cart_weight;
  std::vector<double> theta_weight;  ///< the same of the angle
  /// The result of cart_noise_m() at reading; otherwise it evaluates all samples.
  std::optional<double> known_cart_noise_m;
  std::optional<double> known_theta_noise_rad;  ///< the same of theta_noise_rad()
  std::vector<std::size_t> breaks;              ///< samples preceded by missing rows: no segment crosses them
  /// Of a record with fewer samples than commands: all commands, of which `voltage_v` is the mean. Empty:
  /// each sample has one, `voltage_v`.
  std::vector<VoltageCommand> commands;
  std::vector<std::size_t> first_command;  ///< of each sample the first of `commands` at its time, or empty
  std::vector<Unfolding> unfoldings;       ///< of an angle that its source folded
  std::shared_ptr<const Dataset> dataset;  ///< how it was read; null if not from a file
  std::size_t missing_rows = 0;            ///< rows of the file with a cell that has no number
  std::vector<std::string> notes;          ///< findings and assumptions of the reader

  std::size_t size() const { return time_s.size(); }     ///< number of samples
  bool has_cart() const { return !cart_m.empty(); }      ///< whether the cart was measured
  bool has_theta() const { return !theta_rad.empty(); }  ///< whether the pendulum was measured
  double median_period_s() const;                        ///< median time between samples [s]
  /// Standard deviation of the sensor noise, estimated from the data: quantisation and noise beyond
  /// it.
  double cart_noise_m() const;
  double theta_noise_rad() const;  ///< the same of the angle [rad]
};

/// Reads one item of `--data`. Throws ConfigError with remedy, file and line for unusable data: no common
/// columns, one sample, constant data, text instead of a number, time that does not increase.
Measurement read_measurement(const std::filesystem::path& path);

/// Reads all items of `--data`. A run without motion carries no information on the model, and its encoder
/// may be disconnected: beside runs with motion it is omitted, with a note.
std::vector<Measurement> read_measurements(const std::vector<std::filesystem::path>& paths);

/// The resolution of quantised values: the largest number of which all differences are multiples; 0 when
/// there is none.
double find_resolution(const std::vector<double>& values);

/// The weight of each sample of quantised values. Quantisation errors are independent only after the
/// signal has crossed a step. Within a dwell they are constant: all samples of a dwell at a turning point
/// count as one; in a long dwell, as many as at the speed before and after it.
std::vector<double> dwell_weights(const std::vector<double>& values);

/// Standard deviation of white noise on a smooth signal, from fourth differences.
double find_noise(const std::vector<double>& values);

}  // namespace upright
