// How a rig is wired to a Quanser card: section `quanser_hil` of a rig file.
#pragma once

#include <optional>
#include <string>

namespace upright {

/// What the card's analog output puts out, and what it may be set to.
struct QuanserOutput {
  int channel = 0;
  double low_v = -10.0, high_v = 10.0;
  bool sets_range = false;      ///< the card's output is programmable: it is set to this range
  double amplifier_gain = 1.0;  ///< volts at the motor per volt at the channel
};

/// The digital output that enables the amplifier.
struct QuanserEnable {
  int line = 0;
  bool active_high = true;
};

/// What of a rig is on a Quanser card.
struct QuanserRig {
  std::string library = "libhil.so";  ///< a name that the loader finds, or a path
  std::string folder;                 ///< where the libraries are; empty: where the loader looks
  // What `library` needs, loaded before it. One that is not there is left to the loader.
  std::string common_library = "libquanser_common.so";
  std::string runtime_library = "libquanser_runtime.so";
  std::string board_type;              ///< "q2_usb": what hil_open takes as card type
  std::string board_identifier = "0";  ///< or a URI
  std::string board_options;           ///< for hil_set_card_specific_options; empty: none
  std::optional<int> cart_channel;
  std::optional<int> pendulum_channel;
  std::optional<QuanserOutput> output;
  std::optional<QuanserEnable> amplifier_enable;
  double watchdog_s = 0.0;  ///< on the card; 0: it has none
};

}  // namespace upright
