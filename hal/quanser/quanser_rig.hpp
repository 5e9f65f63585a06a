// A rig on a Quanser card, or the parts of one that are.
//
// Each call of the loop is one of the HIL library's in the loop's own thread: one that reads both encoders,
// one that serves the card's watchdog, one that puts out the voltage. What the library does within a call is
// not known: a reading that took longer than most of a period is stale; a call that hangs makes the cycle
// late, which the loop counts as missed periods and ends at zero volts. Meanwhile the card's own watchdog
// takes the voltage away. So a rig file should give it a time.
//
// With `clock: card` the card samples on its own time (quanser_sampler.hpp). A reading is its newest sample
// then, and a reading without a new one is a reply that did not come.
//
// The watchdog starts with the first voltage and stops once a stop is confirmed. When it expires the card is
// at zero volts and refuses everything until the rig is opened again: that is a confirmed zero.
#pragma once

#include <memory>

#include "../rig_lock.hpp"
#include "quanser_card.hpp"
#include "quanser_sampler.hpp"
#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

class QuanserTransport final : public Rig {
 public:
  QuanserTransport(const RigFile& rig, double period_s);
  ~QuanserTransport() override;
  QuanserTransport(const QuanserTransport&) = delete;
  QuanserTransport& operator=(const QuanserTransport&) = delete;

  void open() override;
  RigReading read() noexcept override;
  RigFault write(double voltage_v) noexcept override;
  StopReport stop() noexcept override;
  DeviceFacts device_facts() const override;
  bool measures_velocities() const noexcept override { return rig_.quanser->reads_velocities; }
  bool is_clock() const noexcept override { return sampler_ != nullptr; }
  DeviceSample wait_next(std::int64_t until_ns) noexcept override;

 private:
  void open_card();
  RigReading read_now() noexcept;
  RigReading read_sample() noexcept;
  RigReading fresh(RigReading reading, const RawCounts& counts) noexcept;
  RigFault add_velocities(RigReading& reading) noexcept;
  RigFault serve_watchdog() noexcept;
  RigFault enable_once() noexcept;
  bool has_expired() noexcept;
  void take_voltage_away(StopReport& report) noexcept;

  RigFile rig_;
  double period_s_;
  std::int64_t patience_ns_;
  RigLock lock_;
  std::unique_ptr<QuanserCard> card_;
  std::unique_ptr<QuanserSampler> sampler_;  // null: the computer is the clock
  std::uint64_t sequence_ = 0;
  SampleReader sample_reader_;
  std::int64_t served_ns_ = 0;  // when the watchdog was last
  bool watching_ = false, enabled_ = false, stopped_ = true;
};

}  // namespace upright
