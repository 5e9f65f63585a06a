// From encoder counts to metres and radians, and from volts to what the amplifier may be given: the layer all
// backends share. Nothing here allocates, locks or throws.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace upright {

/// What the pendulum does when its counts are at zero.
enum class ZeroPose : std::uint8_t { upright, hanging };

/// How one encoder counts.
struct EncoderCalibration {
  double per_count = 0.0;  ///< m or rad, positive
  int sign = 1;            ///< +1 or -1: -1 where the device counts against the positive direction
  int width_bits = 32;     ///< the counter wraps at 2^width_bits (8 to 32)
  /// Faster than this (m/s or rad/s) the shaft cannot turn: counts that say so are not believed.
  double fastest_per_s = 0.0;
};

/// Both encoders and where their zero is.
struct Calibration {
  EncoderCalibration cart;
  EncoderCalibration pendulum;
  /// True: the pose at the first reading is the zero. False: the counts below are.
  bool zero_at_start = false;
  std::int64_t cart_zero_counts = 0;
  std::int64_t pendulum_zero_counts = 0;
  ZeroPose zero_pose = ZeroPose::upright;

  double zero_angle_rad() const { return zero_pose == ZeroPose::hanging ? std::numbers::pi : 0.0; }
};

/// The lowest `width_bits` bits of a count, read as a signed number: from -2^(w-1) to 2^(w-1) - 1.
constexpr std::int64_t signed_counts(std::int64_t counts, int width_bits) noexcept {
  const int unused = 64 - width_bits;
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(counts) << unused) >> unused;
}

/// How far a counter of so many bits moved, the short way round. What a damaged log may hold is more than a
/// signed difference can.
constexpr std::int64_t counts_between(std::int64_t from, std::int64_t to, int width_bits) noexcept {
  const std::uint64_t moved = static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from);
  return signed_counts(static_cast<std::int64_t>(moved), width_bits);
}

/// Follows a counter across its wraps. Right as long as the counter moves by less than half its range between
/// two readings.
class Unwrapper {
 public:
  explicit constexpr Unwrapper(int width_bits = 32) noexcept : width_bits_(width_bits) {}

  /// Starts at `counts`, measured from `zero` the short way round.
  constexpr void start(std::int64_t counts, std::int64_t zero) noexcept {
    last_ = counts;
    total_ = counts_between(zero, counts, width_bits_);
  }
  /// Takes a new reading; returns the counts from zero, without wraps.
  constexpr std::int64_t follow(std::int64_t counts) noexcept {
    total_ += counts_between(last_, counts, width_bits_);
    last_ = counts;
    return total_;
  }
  constexpr std::int64_t total() const noexcept { return total_; }

 private:
  int width_bits_;
  std::int64_t last_ = 0;
  std::int64_t total_ = 0;
};

/// Cart position [m] and pendulum angle [rad, 0 upright, continuous].
struct Pose {
  double cart_m = 0.0;
  double theta_rad = 0.0;
};

/// Turns the device's counts into a pose. The first reading starts it.
class PoseScaler {
 public:
  explicit PoseScaler(const Calibration& calibration = {}) noexcept
      : calibration_(calibration),
        cart_(calibration.cart.width_bits),
        pendulum_(calibration.pendulum.width_bits) {}

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

  /// Counts whole turns away so that the angle lies within -pi and pi, and the motion goes on from there
  /// without a jump. For the moment the loop starts: a pendulum zeroed while hanging may have been lifted
  /// either way round.
  Pose nearest_turn() noexcept {
    turns_ = 0.0;
    turns_ = std::round(pose().theta_rad / (2.0 * std::numbers::pi));
    return pose();
  }

  const Calibration& calibration() const noexcept { return calibration_; }

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

/// The counts an encoder shows at a position: the nearest whole count, wrapped to the counter's width and
/// read as signed. The inverse of `PoseScaler` where the zero is given by counts.
inline std::int64_t counts_at(double position, double zero_position, std::int64_t zero_counts,
                              const EncoderCalibration& encoder) noexcept {
  const double counts = std::nearbyint(encoder.sign * (position - zero_position) / encoder.per_count);
  return signed_counts(zero_counts + static_cast<std::int64_t>(counts), encoder.width_bits);
}

struct EncoderCounts {
  std::int64_t cart = 0;
  std::int64_t pendulum = 0;
};

/// Both encoders' counts at a pose. Where the zero is taken at the start, counts are zero at x = 0 and at the
/// pose the zero names.
inline EncoderCounts counts_at(const Pose& pose, const Calibration& calibration) noexcept {
  return {counts_at(pose.cart_m, 0.0, calibration.cart_zero_counts, calibration.cart),
          counts_at(pose.theta_rad, calibration.zero_angle_rad(), calibration.pendulum_zero_counts,
                    calibration.pendulum)};
}

/// A voltage as the amplifier may be given it: not finite becomes zero, the rest is clamped to the limit.
inline double safe_voltage(double voltage_v, double limit_v) noexcept {
  if (!std::isfinite(voltage_v)) return 0.0;
  return voltage_v > limit_v ? limit_v : voltage_v < -limit_v ? -limit_v : voltage_v;
}

/// True when counts moved further within `elapsed_s` than the fastest motion allows. Two counts are always
/// allowed: that much is quantisation.
inline bool implausible_step(std::int64_t from, std::int64_t to, double elapsed_s,
                             const EncoderCalibration& encoder) noexcept {
  const double moved = std::abs(static_cast<double>(counts_between(from, to, encoder.width_bits)));
  return moved > 2.0 + encoder.fastest_per_s * elapsed_s / encoder.per_count;
}

}  // namespace upright
