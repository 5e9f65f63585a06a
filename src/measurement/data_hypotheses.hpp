// Possible mistakes in the description of a file, and how well the equations of the plant then fit its data.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "motion_windows.hpp"
#include "upright/measurement/measurement.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// The channels of a record, in the order of `measured_quantities` without the time.
enum Channel : std::size_t { voltage_channel, cart_channel, theta_channel, channels };

/// An interpretation of the file: the column, factor and offset of each quantity.
struct DataReading {
  std::array<std::size_t, channels> column = {voltage_channel, cart_channel, theta_channel};
  std::array<double, channels> factor = {1.0, 1.0, 1.0};
  double theta_offset_rad = 0.0;
  double time_factor = 1.0;
  double steady_period_s = 0.0;  ///< of the clock around which the stamps scatter; 0: as stamped
  /// How much later a channel was recorded than measured or commanded.
  std::array<double, channels> later_s = {0.0, 0.0, 0.0};
  double fold = 0.0;  ///< the angle was taken modulo this, in the file's unit; 0: modulo a turn, if at all
  bool mirrored = false;              ///< the angle was mirrored at the ends of its range
  std::vector<std::string> mistakes;  ///< in words; empty: as the file is read now
};

/// The period of the folded angle in radians.
double folded_every_rad(const DataReading& reading);

/// The shares of the motor voltage and of the pendulum's acceleration that the equations account for. Empty
/// if the data show too little. Negative if the equations make it worse.
struct ExplainedShares {
  std::optional<double> cart, pendulum;
  /// To choose between readings: logarithms of the unexplained shares, with numbers close to those of the
  /// plant file.
  double left_over = 0.0;
  /// The least multiple of the recorded voltage that the motion needs.
  double voltage_needed = 0.0;
};

/// The residual of an equation with the channels as they are, or with a delay of the motor that may be there,
/// and with the best delay of one of them (negative: of the others).
struct Lateness {
  double later_s = 0.0;
  double left = 1.0, left_at_best = 1.0;
  /// The smallest left / left_at_best of the thirds of the record.
  double min_gain = 1.0;
};

/// Compares readings of one run with a plant.
class ReadingJudge {
 public:
  ReadingJudge(const Measurement& run, const Plant& plant);

  bool has(std::size_t channel) const { return !raw_[channel].empty(); }
  const std::vector<double>& raw(std::size_t channel) const { return raw_[channel]; }
  double period_s() const { return period_s_; }
  /// The period of the folded angle in the file's unit, if it is an integer fraction of a turn but not a
  /// whole turn.
  std::optional<double> fold() const;
  ExplainedShares judge(const DataReading& reading);
  /// The delay of the angle relative to the cart, from the equation of the pendulum. Empty if the data show
  /// too little.
  std::optional<Lateness> lateness_of_angle(const DataReading& reading) const;
  /// The delay of the voltage relative to the motion, from the equation of the cart. A voltage that comes
  /// before the motion is a delay of the rig.
  std::optional<Lateness> lateness_of_voltage(const DataReading& reading) const;

 private:
  struct Motion {
    WindowedMotion cart, theta;
    std::vector<std::vector<double>> volts;  ///< one per delay
    bool cart_shows = false, theta_shows = false;
    double length_s = 0.0;  ///< of the windows
  };
  using WindowRange = std::pair<std::size_t, std::size_t>;  ///< first, one past the last
  struct Share;                                             ///< the explained share of an equation
  const Motion& motion_of(const DataReading& reading);
  Motion measure(const DataReading& reading, double length_s) const;
  Motion showing(const DataReading& reading) const;
  bool cart_known(const DataReading& reading) const;
  std::optional<Share> cart_share(const DataReading& reading, const Motion& motion,
                                  const std::vector<double>& volts, WindowRange range) const;
  Share pendulum_share(const DataReading& reading, const WindowedMotion& cart, const WindowedMotion& pendulum,
                       WindowRange range) const;
  std::vector<double> channel_of(const DataReading& reading, std::size_t channel) const;
  void judge_cart(const DataReading& reading, const Motion& motion, ExplainedShares& shares) const;
  void judge_pendulum(const DataReading& reading, const Motion& motion, ExplainedShares& shares) const;

  const Measurement& run_;
  const Plant& plant_;
  double period_s_;
  std::array<std::vector<double>, channels> raw_;
  std::map<std::array<double, 10>, Motion> motions_;
};

}  // namespace upright
