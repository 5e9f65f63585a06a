// Wiring of a rig to a Quanser card: section `quanser_hil` of a rig file.
#pragma once

#include <optional>
#include <string>

namespace upright {

/// The analog output of the card and its range.
struct QuanserOutput {
  int channel = 0;              ///< number on the card
  double low_v = -10.0;         ///< lower end of its range
  double high_v = 10.0;         ///< upper end of its range
  bool sets_range = false;      ///< the output range is programmable: set it to this range
  double amplifier_gain = 1.0;  ///< volts at the motor per volt at the channel
};

/// The digital output that enables the amplifier.
struct QuanserEnable {
  int line = 0;             ///< number on the card
  bool active_high = true;  ///< the level that enables the amplifier
};

/// The parts of a rig that are connected to a Quanser card.
struct QuanserRig {
  std::string library = "libhil.so";  ///< name that the dynamic loader resolves, or a path
  std::string folder;                 ///< folder of the libraries; empty: the loader's search path
  // Dependencies of `library`, loaded before it. A missing one is left to the loader.
  std::string common_library = "libquanser_common.so";    ///< as the loader finds it
  std::string runtime_library = "libquanser_runtime.so";  ///< as the loader finds it
  std::string board_type;                                 ///< card type for hil_open, for example "q2_usb"
  std::string board_identifier = "0";                     ///< or a URI
  std::string board_options;                              ///< for hil_set_card_specific_options; empty: none
  bool is_clock = false;                ///< the card samples on its own time, and the loop follows it
  bool reads_velocities = false;        ///< of the encoders, which the card measures
  std::optional<int> cart_channel;      ///< absent: another backend counts
  std::optional<int> pendulum_channel;  ///< absent: another backend counts
  std::optional<QuanserOutput> output;  ///< absent: another backend has the output
  std::optional<QuanserEnable> amplifier_enable;  ///< absent: the card does not enable it
  double watchdog_s = 0.0;                        ///< time of the card's watchdog; 0: none
};

}  // namespace upright
