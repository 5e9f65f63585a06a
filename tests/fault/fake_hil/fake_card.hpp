// A Quanser card that exists only here, with a plant in real time behind its wires: it counts in as many bits
// as its rig file says, has a watchdog that locks it, and misbehaves on request. Its record of its own output
// is what tests look at.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "../../../hal/virtual/virtual_plant.hpp"
#include "upright/hal/rig_file.hpp"
#include "wire.hpp"

namespace upright::fake_hil {

/// What goes wrong, from when the pendulum is let go. Times are seconds from then; 0 is never.
struct Mishaps {
  int late_every = 0;  ///< one call in so many answers late
  double late_s = 0.0;
  int fail_every = 0;           ///< one call in so many times out
  double unplug_after_s = 0.0;  ///< no call succeeds any more
  double expire_after_s = 0.0;  ///< the watchdog expires though it was served
  double refuse_after_s = 0.0;  ///< voltages are refused, the last one stays
  double stick_after_s = 0.0;   ///< an encoder stops counting
  bool stick_cart = true;
  double jump_after_s = 0.0;  ///< the cart's counts jump
  int jump_counts = 0;
  int failed_openings = 0;  ///< so many attempts to open it fail
  bool locked_at_start = false;
  bool lacks_velocities = false;
  double silent_s = 1e9;  ///< once told to be silent: for so long
  // Of a task on the card's own clock.
  double drift_ppm = 0.0;        ///< its period is longer by this, from the beginning on
  int drop_every = 0;            ///< one sample in so many is not taken
  bool never_samples = false;    ///< nor is any other
  double stop_sampling_s = 0.0;  ///< it takes no samples any more, and answers everything else
};

class FakeCard {
 public:
  FakeCard(const RigFile& rig, const Plant& plant, const VirtualRigOptions& options,
           const std::filesystem::path& record, const Mishaps& mishaps);

  /// Moves the plant, and lets the watchdog expire where it is due.
  void advance_to(std::int64_t now_ns);
  /// How long this call's answer is held back.
  double late_s(const Request& request);
  Reply answer(const Request& request);
  /// Begins a task: a sample is due with each period of the card's own clock.
  Reply start_task(const Request& request);
  /// The sample that is due; none: it is not due yet, or is not taken.
  std::optional<Reply> sample();
  /// When the next one is due; `for_ever_ns` without a task.
  std::int64_t sample_due_ns() const { return sample_due_ns_; }
  void end_task() { sample_due_ns_ = for_ever_ns; }
  static constexpr std::int64_t for_ever_ns = INT64_MAX;
  /// The program that had it open is gone.
  void hang_up() { open_ = false; }
  /// From now on no call succeeds, for the time that the mishaps say.
  void be_silent(std::int64_t now_ns);

 private:
  static constexpr int lines = 32;

  bool is_due(double after_s) const { return after_s > 0.0 && plant_.free_s() >= after_s; }
  bool is_unreachable() const;
  std::optional<Reply> mishap_of(const Request& request);
  Reply open();
  Reply on_hardware(const Request& request);
  Reply counts();
  Reply velocities(const Request& request) const;
  void act_of_watchdog(const Request& request, Reply& reply);
  void expire();
  void drive();
  void put(const Request& request);
  void record();

  RigFile rig_;
  VirtualPlant plant_;
  Mishaps mishaps_;
  std::ofstream record_;
  std::int64_t now_ns_ = 0, expires_ns_ = 0, silent_until_ns_ = 0;
  std::array<double, lines> analog_v_{}, digital_{}, expire_v_{}, expire_digital_{};
  std::array<double, lines> leave_v_{}, leave_digital_{};
  std::array<std::int64_t, lines> count_offset_{};
  std::optional<EncoderCounts> stuck_;
  double timeout_s_ = 0.0;
  Request task_;
  double sample_period_ns_ = 0.0, sample_due_exact_ns_ = 0.0;
  std::int64_t sample_due_ns_ = for_ever_ns;
  int calls_ = 0, openings_ = 0, samples_ = 0;
  bool open_ = false, watching_ = false, expired_ = false;
};

/// Serves the card at a socket until `stopped` says so. `silence` begins when it becomes true.
void serve(FakeCard& card, const std::string& socket, const volatile int& stopped,
           const volatile int& silence);

}  // namespace upright::fake_hil
