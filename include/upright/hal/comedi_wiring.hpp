// Wiring of a rig to Comedi devices: section `comedi` of a rig file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace upright {

/// What counts an encoder.
enum class ComediEncoderKind : std::uint8_t {
  counter,        ///< a quadrature counter, configured as its driver requires
  plain_counter,  ///< a counter that is configured elsewhere and only read
  analog_input,   ///< a potentiometer
};

/// Reference potential of an analog input.
enum class ComediReference : std::uint8_t { ground, common, difference, other };

/// Limits of a voltage range that a channel offers.
struct ComediRange {
  double low_v = 0.0;   ///< lower end [V]
  double high_v = 0.0;  ///< upper end [V]
};

/// Input lines (PFI) for A and B of an encoder, where the driver can route them to a counter.
struct ComediLines {
  int a = 0;  ///< of signal A
  int b = 0;  ///< of signal B
};

/// How an encoder is wired.
struct ComediEncoder {
  std::string device;                                   ///< "/dev/comedi0"
  int subdevice = 0;                                    ///< of the card
  int channel = 0;                                      ///< of the subdevice
  ComediEncoderKind kind = ComediEncoderKind::counter;  ///< what counts
  std::optional<ComediLines> lines;                     ///< counter: as its driver requires
  // Analog input only.
  ComediRange range;                                    ///< of an analog input
  ComediReference reference = ComediReference::ground;  ///< of an analog input
  double counts_per_v = 0.0;                            ///< of an analog input [1/V]
};

/// How the amplifier is wired.
struct ComediOutput {
  std::string device;           ///< file of the card: /dev/comedi0
  int subdevice = 0;            ///< of the card
  int channel = 0;              ///< of the subdevice
  ComediRange range;            ///< of the output
  double amplifier_gain = 1.0;  ///< volts at the motor per volt at the channel
};

/// The parts of a rig that are connected to Comedi devices.
struct ComediRig {
  std::optional<ComediEncoder> cart;      ///< absent: another backend counts
  std::optional<ComediEncoder> pendulum;  ///< absent: another backend counts
  std::optional<ComediOutput> output;     ///< absent: another backend has the output
};

}  // namespace upright
