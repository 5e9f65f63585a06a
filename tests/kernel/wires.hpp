// What joins a plant to simulated devices, the kernel's or a board's, and what can happen to it.
#pragma once

#include <cstdint>

#include "upright/hal/calibration.hpp"

namespace upright::test {

/// Comes for good, except that the rattling encoder and the burst end where they began.
enum class Mishap : std::uint8_t {
  none,
  cart_jumps,
  cart_has_no_contact,
  cart_sticks,
  pendulum_sticks,
  encoders_go,      ///< the device that has them
  encoder_rattles,  ///< faster than edges may come
  edges_burst,      ///< more edges at once than the kernel's queue holds
  edges_too_fast,   ///< the device that counts them cannot
  device_restarts,
  program_hangs,  ///< the device's
  emergency_stop,
  plus_switch,
  minus_switch,
};

/// Used by the plant's thread only, but for `at_rest`.
class Wires {
 public:
  virtual ~Wires() = default;
  /// What the motor gets.
  virtual double motor_v(std::int64_t now_ns) = 0;
  virtual void show(const EncoderCounts& counts) = 0;
  virtual void suffer(Mishap mishap) = 0;
  /// After a stop: is everything off that could move the motor?
  virtual bool at_rest() const = 0;
};

}  // namespace upright::test
