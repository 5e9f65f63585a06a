// An open Comedi device, as set-up code asks it: every refusal names the device, what it offers, and the
// remedy.
#pragma once

#include <comedilib.h>

#include <string>

#include "upright/hal/wiring.hpp"

namespace upright {

/// Where a rig file's channel is, for asking and for sentences.
struct ComediChannel {
  const char* key;  ///< "cart", "pendulum" or "output"
  int subdevice;
  int channel;
};

class ComediCard {
 public:
  /// Opens `device`. Throws DeviceError. `rig_file` is what sentences show.
  ComediCard(const std::string& device, const std::string& rig_file);
  ~ComediCard();
  ComediCard(const ComediCard&) = delete;
  ComediCard& operator=(const ComediCard&) = delete;

  comedi_t* handle() const noexcept { return handle_; }
  const std::string& device() const noexcept { return device_; }
  std::string driver() const;

  /// Throws ConfigError where there is no such subdevice or channel.
  void require(const ComediChannel& at) const;
  /// Throws ConfigError where the subdevice is not of `type`, which is called `name`.
  void require_type(const ComediChannel& at, int type, const char* name) const;
  /// Keeps other programs away from the subdevice until the device is closed. Throws DeviceError when another
  /// has it.
  void lock(const ComediChannel& at);
  /// The number of the range with these ends. Throws ConfigError that lists those there are.
  unsigned int find_range(const ComediChannel& at, const ComediRange& range) const;
  lsampl_t maxdata(const ComediChannel& at) const;

  /// Throws ConfigError: "remedy: rig file:1: comedi.KEY: problem".
  [[noreturn]] void refuse(const ComediChannel& at, const std::string& problem,
                           const std::string& remedy) const;
  /// Throws DeviceError with what libcomedi says.
  [[noreturn]] void fail(const ComediChannel& at, const std::string& doing) const;

 private:
  std::string device_, rig_file_;
  comedi_t* handle_;
};

/// What a failed libcomedi call says.
std::string comedi_problem();

}  // namespace upright
