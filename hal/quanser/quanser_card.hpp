// An open Quanser card. Set-up code throws, with the remedy; what the loop calls returns the library's own
// numbers and neither allocates nor throws.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include "hil_library.hpp"
#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

struct RawCounts {
  std::int32_t cart = 0, pendulum = 0;
};

/// In counts per second; not a number where another backend counts.
struct RawVelocities {
  double cart = std::numeric_limits<double>::quiet_NaN();
  double pendulum = std::numeric_limits<double>::quiet_NaN();
};

class QuanserCard {
 public:
  /// Opens the card, which may take several attempts. Throws DeviceError.
  explicit QuanserCard(const RigFile& rig);
  ~QuanserCard();
  QuanserCard(const QuanserCard&) = delete;
  QuanserCard& operator=(const QuanserCard&) = delete;

  /// Unlocks the card where an expired watchdog has locked it, puts out zero volts with the amplifier
  /// disabled, and sets up the rest. Throws DeviceError.
  void prepare();
  /// Counters begin at zero, in the middle of their range. Throws DeviceError.
  void clear_counts();
  /// What the card says of itself. A part it does not tell is left out.
  DeviceFacts facts() const;
  /// A card that measures no velocities returns an error.
  hil::Error read_velocities(RawVelocities& velocities) const noexcept;

  hil::Error read_counts(RawCounts& counts) const noexcept;

  /// A task of the card that samples the encoders `rate_hz` times per second, on the card's own clock. Throws
  /// DeviceError.
  hil::Task start_sampling(double rate_hz) const;
  /// Waits for the task's next sample. 0: the task was stopped, there is no sample.
  hil::Error wait_for_sample(hil::Task task, RawCounts& counts) const noexcept;
  /// Ends the wait of whoever waits for a sample.
  void stop_sampling(hil::Task task) const noexcept { hil_.task_stop(task); }
  void delete_task(hil::Task task) const noexcept { hil_.task_delete(task); }

  /// `voltage_v` is finite.
  hil::Error put_out(double voltage_v) const noexcept;
  hil::Error enable(bool on) const noexcept;
  bool has_enable() const noexcept { return wiring_.amplifier_enable.has_value(); }
  hil::Error write_termination_states() const noexcept;

  /// 0: the card has none.
  double watchdog_s() const noexcept { return wiring_.watchdog_s; }
  hil::Error start_watchdog() const noexcept { return hil_.watchdog_start(card_, wiring_.watchdog_s); }
  /// hil::reloaded, hil::expired_before, or an error.
  hil::Error reload_watchdog() const noexcept { return hil_.watchdog_reload(card_); }
  /// The watchdog has taken the voltage away, and locked the card. A library that can only be asked by
  /// serving the watchdog once more is asked where `serving_allowed`.
  bool has_expired(bool serving_allowed) const noexcept;
  void stop_watchdog() const noexcept;
  /// Unlocks the card after its watchdog expired.
  hil::Error clear_watchdog() const noexcept { return hil_.watchdog_clear(card_); }

  const HilLibrary& library() const noexcept { return library_; }
  /// Throws DeviceError: "error 14: ... while doing ...: check the card".
  [[noreturn]] void fail(hil::Error error, const std::string& doing) const;

 private:
  hil::Error open_once();
  [[noreturn]] void refuse_opening(hil::Error error) const;
  void require_functions() const;
  template <class Raw, class Value>
  Raw by_encoder(const std::array<Value, 2>& read) const noexcept;
  void set_up_output();
  void set_up_enable();
  void set_up_encoders() const;
  void require_velocities() const;
  void set_up_watchdog() const;
  void put_out_zero() const;
  void require(hil::Error error, const std::string& doing) const;
  void require_where_supported(hil::Error error, const std::string& doing) const;

  QuanserRig wiring_;
  std::string rig_file_;
  double amplifier_sign_;
  HilLibrary library_;
  hil::Functions hil_;
  hil::Card card_ = nullptr;
  std::array<unsigned, 2> encoders_{};
  unsigned encoder_count_ = 0;
  /// The card knows what to leave its output, and its enable line, at.
  bool knows_termination_ = false;
};

/// What an error means to the loop.
RigFault fault_of(hil::Error error) noexcept;

}  // namespace upright
