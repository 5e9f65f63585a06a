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
  int line = 0;
  bool active_high = true;  ///< the level that means pressed, or enabled
  LineBias bias = LineBias::as_is;
};

/// The ends of the track.
enum class TrackEnd : std::uint8_t { plus_x, minus_x };

struct LimitSwitch {
  TrackEnd end = TrackEnd::plus_x;
  DigitalLine line;
};

/// An incremental encoder whose edges the kernel reports. Each edge of either line is one count.
struct LineEncoder {
  int a = 0;  ///< counts increase where A leads B
  int b = 0;
  LineBias bias = LineBias::as_is;
  double fastest_edges_per_s = 0.0;  ///< a higher rate is a fault, because edges might be lost
};

struct GpioRig {
  std::string chip;  ///< name (gpiochip0), label, or path (/dev/gpiochip0)
  std::optional<DigitalLine> emergency_stop;
  std::vector<LimitSwitch> limit_switches;
  std::optional<DigitalLine> amplifier_enable;
  std::optional<int> heartbeat;  ///< a line toggled with every voltage, for an external watchdog
  std::optional<LineEncoder> cart_encoder;
  std::optional<LineEncoder> pendulum_encoder;
};

}  // namespace upright
