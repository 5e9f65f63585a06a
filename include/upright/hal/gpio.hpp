// Wiring of a rig to digital lines of a GPIO chip: section `gpio` of a rig file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace upright {

/// Bias resistors of the chip on an input, where it has them.
enum class LineBias : std::uint8_t { as_is, pull_up, pull_down };

/// One line, identified by its offset on the chip.
struct DigitalLine {
  int line = 0;                     ///< number on the chip
  bool active_high = true;          ///< the level that means pressed, or enabled
  LineBias bias = LineBias::as_is;  ///< the chip's own resistor
};

/// The ends of the track.
enum class TrackEnd : std::uint8_t { plus_x, minus_x };

/// A switch at an end of the track.
struct LimitSwitch {
  TrackEnd end = TrackEnd::plus_x;  ///< at which end
  DigitalLine line;                 ///< how it is wired
};

/// An incremental encoder whose edges the kernel reports. Each edge of either line is one count.
struct LineEncoder {
  int a = 0;                         ///< counts increase where A leads B
  int b = 0;                         ///< number of signal B on the chip
  LineBias bias = LineBias::as_is;   ///< the chip's own resistors
  double fastest_edges_per_s = 0.0;  ///< a higher rate is a fault, because edges might be lost
};

/// Section `gpio` of a rig file.
struct GpioRig {
  std::string chip;                             ///< name (gpiochip0), label, or path (/dev/gpiochip0)
  std::optional<DigitalLine> emergency_stop;    ///< stops the motor while it is active
  std::vector<LimitSwitch> limit_switches;      ///< stop the motor while they are active
  std::optional<DigitalLine> amplifier_enable;  ///< active while the motor may move
  std::optional<int> heartbeat;             ///< a line toggled with every voltage, for an external watchdog
  std::optional<LineEncoder> cart_encoder;  ///< absent: another backend counts
  std::optional<LineEncoder> pendulum_encoder;  ///< absent: another backend counts
};

}  // namespace upright
