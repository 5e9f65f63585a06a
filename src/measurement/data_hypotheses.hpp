// What may be wrong with a file's description, and how well the plant's equations then fit its data.
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

/// A reading of the file: which column is which quantity, and what each is multiplied by and shifted by.
struct DataReading {
  std::array<std::size_t, channels> column = {voltage_channel, cart_channel, theta_channel};
  std::array<double, channels> factor = {1.0, 1.0, 1.0};
  double theta_offset_rad = 0.0;
  double time_factor = 1.0;
  double steady_period_s = 0.0;  ///< of the clock about which the stamps scatter; 0: as stamped
  /// How much later than measured, or commanded, a channel was written down.
  std::array<double, channels> later_s = {0.0, 0.0, 0.0};
  double fold = 0.0;  ///< the angle was taken modulo this, in the file's unit; 0: modulo a turn, if at all
  bool mirrored = false;              ///< the angle was mirrored at the ends of its range
  std::vector<std::string> mistakes;  ///< in words; none: as the file is read now
};

/// What the angle is unfolded by, once it is in radians.
double folded_every_rad(const DataReading& reading);

/// Shares of the motor's voltage and of the pendulum's acceleration that the equations account for; nothing
/// where too little shows. Below 0: they make it worse.
struct Accounted {
  std::optional<double> cart, pendulum;
  /// To choose between readings: logarithms of the shares that are left over, with the plant's numbers nearly
  /// as the file has them.
  double left_over = 0.0;
  /// How many times the recorded voltage the motion needs at the least.
  double voltage_needed = 0.0;
};

/// How much is left over of an equation as the channels are, and at best where one of them is taken to have
/// been written down later than measured (negative: the others).
struct Lateness {
  double later_s = 0.0;
  double left = 1.0, left_at_best = 1.0;
  /// left / left_at_best in that third of the record where it is least.
  double least_gain = 1.0;
};

/// Holds readings of one run against a plant.
class ReadingJudge {
 public:
  ReadingJudge(const Measurement& run, const Plant& plant);

  bool has(std::size_t channel) const { return !raw_[channel].empty(); }
  const std::vector<double>& raw(std::size_t channel) const { return raw_[channel]; }
  double period_s() const { return period_s_; }
  /// What the angle was folded by, in the file's unit, where it is a whole part of a turn but no turn.
  std::optional<double> fold() const;
  Accounted judge(const DataReading& reading);
  /// Of the angle against the cart, by the pendulum's equation; nothing where too little shows.
  std::optional<Lateness> lateness_of_angle(const DataReading& reading) const;
  /// Of the voltage against the motions, by the cart's; that it comes before them is a rig's own delay.
  std::optional<Lateness> lateness_of_voltage(const DataReading& reading) const;

 private:
  struct Motion {
    WindowedMotion cart, theta;
    std::vector<std::vector<double>> volts;  ///< one per delay
    bool cart_shows = false, theta_shows = false;
    double length_s = 0.0;  ///< of the windows
  };
  using WindowRange = std::pair<std::size_t, std::size_t>;  ///< first, one past the last
  struct Share;                                             ///< of an equation that is accounted for
  const Motion& motion_of(const DataReading& reading);
  Motion measure(const DataReading& reading, double length_s) const;
  Motion showing(const DataReading& reading) const;
  bool cart_known(const DataReading& reading) const;
  std::optional<Share> cart_share(const DataReading& reading, const Motion& motion,
                                  const std::vector<double>& volts, WindowRange range) const;
  Share pendulum_share(const DataReading& reading, const WindowedMotion& cart, const WindowedMotion& pendulum,
                       WindowRange range) const;
  std::vector<double> channel_of(const DataReading& reading, std::size_t channel) const;
  void judge_cart(const DataReading& reading, const Motion& motion, Accounted& accounted) const;
  void judge_pendulum(const DataReading& reading, const Motion& motion, Accounted& accounted) const;

  const Measurement& run_;
  const Plant& plant_;
  double period_s_;
  std::array<std::vector<double>, channels> raw_;
  std::map<std::array<double, 10>, Motion> motions_;
};

}  // namespace upright
