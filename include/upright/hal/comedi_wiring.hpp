// Wiring of a rig to Comedi devices: section `comedi` of a rig file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace upright {

enum class ComediEncoderKind : std::uint8_t {
  counter,        ///< a quadrature counter, configured as its driver requires
  plain_counter,  ///< a counter that is configured elsewhere and only read
  analog_input,   ///< a potentiometer
};

/// Reference potential of an analog input.
enum class ComediReference : std::uint8_t { ground, common, difference, other };

/// Limits of a voltage range that a channel offers.
struct ComediRange {
  double low_v = 0.0;
  double high_v = 0.0;
};

/// Input lines (PFI) for A and B of an encoder, where the driver can route them to a counter.
struct ComediLines {
  int a = 0;
  int b = 0;
};

struct ComediEncoder {
  std::string device;  ///< "/dev/comedi0"
  int subdevice = 0;
  int channel = 0;
  ComediEncoderKind kind = ComediEncoderKind::counter;
  std::optional<ComediLines> lines;  ///< counter: as its driver requires
  // Analog input only.
  ComediRange range;
  ComediReference reference = ComediReference::ground;
  double counts_per_v = 0.0;
};

struct ComediOutput {
  std::string device;
  int subdevice = 0;
  int channel = 0;
  ComediRange range;
  double amplifier_gain = 1.0;  ///< volts at the motor per volt at the channel
};

/// The parts of a rig that are connected to Comedi devices.
struct ComediRig {
  std::optional<ComediEncoder> cart;
  std::optional<ComediEncoder> pendulum;
  std::optional<ComediOutput> output;
};

}  // namespace upright
