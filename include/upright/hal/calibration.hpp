// Conversion from encoder counts to metres and radians, and limitation of voltages: the layer that all
// backends share. Nothing here allocates, locks or throws.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace upright {

/// The pose of the pendulum at zero counts.
enum class ZeroPose : std::uint8_t { upright, hanging };

/// Calibration of one encoder.
struct EncoderCalibration {
  double per_count = 0.0;  ///< resolution: m or rad per count, positive
  int sign = 1;            ///< +1 or -1; -1: the device counts against the positive direction
  int width_bits = 32;     ///< width of the counter, which wraps at 2^width_bits (8 to 32)
  /// Greatest possible speed of the shaft (m/s or rad/s): counts that imply more are rejected.
  double fastest_per_s = 0.0;
};

/// Calibration of both encoders and their zeros.
struct Calibration {
  EncoderCalibration cart;      ///< metres per count
  EncoderCalibration pendulum;  ///< radians per count
  /// True: the pose at the first reading is the zero. False: the counts below are the zero.
  bool zero_at_start = false;
  std::int64_t cart_zero_counts = 0;       ///< counts of the cart at its zero
  std::int64_t pendulum_zero_counts = 0;   ///< counts of the pendulum at the zero pose
  ZeroPose zero_pose = ZeroPose::upright;  ///< how the pendulum is at its zero counts

  /// Angle at the zero counts [rad].
  double zero_angle_rad() const { return zero_pose == ZeroPose::hanging ? std::numbers::pi : 0.0; }
};

/// The lowest `width_bits` bits of a count as a two's complement number: -2^(w-1) to 2^(w-1) - 1.
constexpr std::int64_t signed_counts(std::int64_t counts, int width_bits) noexcept {
  const int unused = 64 - width_bits;
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(counts) << unused) >> unused;
}

/// Signed difference of two readings of a counter, modulo its width. Computed without overflow, since a
/// damaged log may hold any counts.
constexpr std::int64_t counts_between(std::int64_t from, std::int64_t to, int width_bits) noexcept {
  const std::uint64_t moved = static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from);
  return signed_counts(static_cast<std::int64_t>(moved), width_bits);
}

/// Unwraps the counts of one counter. Correct as long as the counter moves by less than half its range
/// between two readings.
class Unwrapper {
 public:
  /// `width_bits`: of the device's counter.
  explicit constexpr Unwrapper(int width_bits = 32) noexcept : width_bits_(width_bits) {}

  /// Starts at `counts`, relative to `zero` modulo the counter's range.
  constexpr void start(std::int64_t counts, std::int64_t zero) noexcept {
    last_ = counts;
    total_ = counts_between(zero, counts, width_bits_);
  }
  /// Takes a new reading; returns the unwrapped counts relative to zero.
  constexpr std::int64_t follow(std::int64_t counts) noexcept {
    total_ += counts_between(last_, counts, width_bits_);
    last_ = counts;
    return total_;
  }
  /// Counts since the first ones, unwrapped.
  constexpr std::int64_t total() const noexcept { return total_; }

 private:
  int width_bits_;
  std::int64_t last_ = 0;
  std::int64_t total_ = 0;
};

/// Cart position [m] and pendulum angle [rad, 0 upright, continuous].
struct Pose {
  double cart_m = 0.0;     ///< position of the cart [m]
  double theta_rad = 0.0;  ///< angle of the pendulum [rad], 0 upright
};

/// Converts the device's counts to a pose. The first reading initialises it.
class PoseScaler {
 public:
  /// Starts without history: the first counts set the turn.
  explicit PoseScaler(const Calibration& calibration = {}) noexcept
      : calibration_(calibration),
        cart_(calibration.cart.width_bits),
        pendulum_(calibration.pendulum.width_bits) {}

  /// The pose for the device's counts, unwrapped from the ones before.
  Pose scale(std::int64_t cart_counts, std::int64_t pendulum_counts) noexcept {
    if (!started_) {
      started_ = true;
      cart_.start(cart_counts, calibration_.zero_at_start ? cart_counts : calibration_.cart_zero_counts);
      pendulum_.start(pendulum_counts,
                      calibration_.zero_at_start ? pendulum_counts : calibration_.pendulum_zero_counts);
    } else {
      cart_.follow(cart_counts);
      pendulum_.follow(pendulum_counts);
    }
    return pose();
  }

  /// Removes whole turns so that the angle lies between -pi and pi; later poses continue from there.
  /// Called when the loop starts, since a pendulum that was zeroed while hanging may have been lifted
  /// either way.
  Pose nearest_turn() noexcept {
    turns_ = 0.0;
    turns_ = std::round(pose().theta_rad / (2.0 * std::numbers::pi));
    return pose();
  }

  /// Of the device's counts per second [m/s].
  double cart_velocity_mps(double counts_per_s) const noexcept {
    return calibration_.cart.sign * calibration_.cart.per_count * counts_per_s;
  }
  /// Of the device's counts per second [rad/s].
  double pendulum_rate_radps(double counts_per_s) const noexcept {
    return calibration_.pendulum.sign * calibration_.pendulum.per_count * counts_per_s;
  }

  const Calibration& calibration() const noexcept { return calibration_; }  ///< the calibration in use

 private:
  Pose pose() const noexcept {
    const EncoderCalibration& c = calibration_.cart;
    const EncoderCalibration& p = calibration_.pendulum;
    return {c.sign * c.per_count * static_cast<double>(cart_.total()),
            calibration_.zero_angle_rad() + p.sign * p.per_count * static_cast<double>(pendulum_.total()) -
                2.0 * std::numbers::pi * turns_};
  }

  Calibration calibration_;
  Unwrapper cart_, pendulum_;
  double turns_ = 0.0;
  bool started_ = false;
};

/// The counts of an encoder at a position: rounded to the nearest count, wrapped to the counter's width,
/// signed. The inverse of `PoseScaler` where the zero is given by counts.
inline std::int64_t counts_at(double position, double zero_position, std::int64_t zero_counts,
                              const EncoderCalibration& encoder) noexcept {
  const double counts = std::nearbyint(encoder.sign * (position - zero_position) / encoder.per_count);
  return signed_counts(zero_counts + static_cast<std::int64_t>(counts), encoder.width_bits);
}

/// Counts of both encoders.
struct EncoderCounts {
  std::int64_t cart = 0;      ///< of the cart's encoder
  std::int64_t pendulum = 0;  ///< of the pendulum's encoder
};

/// The counts of both encoders at a pose. If the zero is taken at the start, counts are zero at x = 0 and
/// at the angle of the zero pose.
inline EncoderCounts counts_at(const Pose& pose, const Calibration& calibration) noexcept {
  return {counts_at(pose.cart_m, 0.0, calibration.cart_zero_counts, calibration.cart),
          counts_at(pose.theta_rad, calibration.zero_angle_rad(), calibration.pendulum_zero_counts,
                    calibration.pendulum)};
}

/// A voltage that is safe for the amplifier: clamped to the limit; zero if it was not finite.
inline double safe_voltage(double voltage_v, double limit_v) noexcept {
  if (!std::isfinite(voltage_v)) return 0.0;
  return voltage_v > limit_v ? limit_v : voltage_v < -limit_v ? -limit_v : voltage_v;
}

/// True when the counts moved further within `elapsed_s` than the greatest speed allows. Two counts are
/// always allowed, because of quantisation.
inline bool implausible_step(std::int64_t from, std::int64_t to, double elapsed_s,
                             const EncoderCalibration& encoder) noexcept {
  const double moved = std::abs(static_cast<double>(counts_between(from, to, encoder.width_bits)));
  return moved > 2.0 + encoder.fastest_per_s * elapsed_s / encoder.per_count;
}

}  // namespace upright
