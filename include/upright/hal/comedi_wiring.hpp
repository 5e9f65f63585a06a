// How a rig is wired to Comedi devices: section `comedi` of a rig file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace upright {

enum class ComediEncoderKind : std::uint8_t {
  counter,        ///< a quadrature counter, set up as its driver needs it
  plain_counter,  ///< a counter that something else has set up: it is only read
  analog_input,   ///< a potentiometer
};

/// What an analog input is measured against.
enum class ComediReference : std::uint8_t { ground, common, difference, other };

/// The ends of a range that a channel offers.
struct ComediRange {
  double low_v = 0.0;
  double high_v = 0.0;
};

/// The input lines (PFI) that a counter takes an encoder's A and B from, where its driver lets one choose.
struct ComediLines {
  int a = 0;
  int b = 0;
};

struct ComediEncoder {
  std::string device;  ///< "/dev/comedi0"
  int subdevice = 0;
  int channel = 0;
  ComediEncoderKind kind = ComediEncoderKind::counter;
  std::optional<ComediLines> lines;  ///< counter: as its driver asks for
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

/// What of a rig is on Comedi devices.
struct ComediRig {
  std::optional<ComediEncoder> cart;
  std::optional<ComediEncoder> pendulum;
  std::optional<ComediOutput> output;
};

}  // namespace upright
