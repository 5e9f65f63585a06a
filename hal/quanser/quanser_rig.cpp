#include "quanser_rig.hpp"

#include <cmath>

#include "hal/reading_patience.hpp"
#include "upright/hal/clock.hpp"

namespace upright {

namespace {

constexpr int attempts_at_the_end = 3;

}  // namespace

QuanserTransport::QuanserTransport(const RigFile& rig, double period_s)
    : rig_(rig),
      period_s_(period_s),
      patience_ns_(static_cast<std::int64_t>(1e9 * reading_share_of_period * period_s)) {}

QuanserTransport::~QuanserTransport() {
  for (int i = 0; i < attempts_at_the_end && !stop().done(); ++i) {
  }
}

void QuanserTransport::open() {
  stop();
  lock_.take("quanser-hil " + rig_.quanser->board_type + " " + rig_.quanser->board_identifier);
  watching_ = enabled_ = false;
  open_card();
  stopped_ = false;
}

/// A card that is open stays so, and its counters go on. One that is gone stays gone: its counts are lost.
void QuanserTransport::open_card() {
  const bool is_new = !card_;
  sampler_.reset();
  if (is_new) card_ = std::make_unique<QuanserCard>(rig_);
  card_->prepare();
  if (is_new && rig_.calibration.zero_at_start) card_->clear_counts();
  if (!rig_.quanser->is_clock) return;
  sampler_ = std::make_unique<QuanserSampler>(*card_, period_s_, rig_.file.string());
  sample_reader_ = {};
}

DeviceSample QuanserTransport::wait_next(std::int64_t until_ns) noexcept {
  if (!sampler_) return {};
  return sample_reader_.wait_next(sampler_->samples(), until_ns);
}

RigReading QuanserTransport::read() noexcept {
  RigReading reading;
  reading.fault = RigFault::link_lost;
  if (!card_) return reading;
  return sampler_ ? read_sample() : read_now();
}

RigReading QuanserTransport::read_now() noexcept {
  RigReading reading;
  RawCounts counts;
  const std::int64_t asked_ns = monotonic_ns();
  const hil::Error error = card_->read_counts(counts);
  const std::int64_t answered_ns = monotonic_ns();
  reading.time_ns = asked_ns + (answered_ns - asked_ns) / 2;
  if (error < 0) {
    reading.fault = has_expired() ? RigFault::watchdog_expired : fault_of(error);
    return reading;
  }
  if (answered_ns - asked_ns > patience_ns_) {
    reading.status = RigStatus::stale;
    reading.fault = RigFault::link_timeout;
    return reading;
  }
  return fresh(reading, counts);
}

RigReading QuanserTransport::read_sample() noexcept {
  RigReading reading;
  const RingSample sample = sampler_->samples().latest();
  reading.time_ns = sample.when.time_ns;
  if (sample.trouble != 0) {
    reading.fault = has_expired() ? RigFault::watchdog_expired : fault_of(sample.trouble);
    return reading;
  }
  if (!sample_reader_.is_new(sample)) {
    reading.fault = RigFault::link_timeout;
    return reading;
  }
  return fresh(reading, {static_cast<std::int32_t>(sample.cart), static_cast<std::int32_t>(sample.pendulum)});
}

/// Those of now, where the file asks for them.
RigFault QuanserTransport::add_velocities(RigReading& reading) noexcept {
  if (!rig_.quanser->reads_velocities) return RigFault::none;
  RawVelocities velocities;
  const hil::Error error = card_->read_velocities(velocities);
  if (error < 0) return fault_of(error);
  reading.cart_counts_per_s = velocities.cart;
  reading.pendulum_counts_per_s = velocities.pendulum;
  return RigFault::none;
}

RigReading QuanserTransport::fresh(RigReading reading, const RawCounts& counts) noexcept {
  reading.fault = add_velocities(reading);
  if (reading.fault != RigFault::none) return reading;
  reading.cart_counts = signed_counts(counts.cart, rig_.calibration.cart.width_bits);
  reading.pendulum_counts = signed_counts(counts.pendulum, rig_.calibration.pendulum.width_bits);
  reading.sequence = ++sequence_;
  reading.status = RigStatus::fresh;
  return reading;
}

/// Asking a watchdog that cannot be asked otherwise serves it: only when it must have expired by now.
bool QuanserTransport::has_expired() noexcept {
  if (!watching_) return false;
  const auto patience_ns = static_cast<std::int64_t>(1e9 * card_->watchdog_s());
  const std::int64_t asked_ns = monotonic_ns();
  const bool is_due = asked_ns - served_ns_ > patience_ns;
  if (is_due) served_ns_ = asked_ns;
  return card_->has_expired(is_due);
}

RigFault QuanserTransport::serve_watchdog() noexcept {
  if (card_->watchdog_s() <= 0.0) return RigFault::none;
  if (!watching_) {
    const hil::Error error = card_->start_watchdog();
    if (error < 0) return fault_of(error);
    watching_ = true;
  } else {
    const hil::Error answer = card_->reload_watchdog();
    if (answer == hil::expired_before) return RigFault::watchdog_expired;
    if (answer < 0) return fault_of(answer);
  }
  served_ns_ = monotonic_ns();
  return RigFault::none;
}

/// With the first voltage, which is on the output by then.
RigFault QuanserTransport::enable_once() noexcept {
  if (enabled_) return RigFault::none;
  const hil::Error error = card_->enable(true);
  if (error < 0) return fault_of(error);
  enabled_ = true;
  return RigFault::none;
}

RigFault QuanserTransport::write(double voltage_v) noexcept {
  if (!card_ || !rig_.quanser->output) return RigFault::device_refused;
  if (stopped_) return RigFault::none;
  if (const RigFault fault = serve_watchdog(); fault != RigFault::none) return fault;
  const hil::Error error = card_->put_out(safe_voltage(voltage_v, rig_.amplifier.limit_v));
  if (!std::isfinite(voltage_v)) return RigFault::not_finite;
  if (error < 0) return has_expired() ? RigFault::watchdog_expired : fault_of(error);
  return enable_once();
}

/// What the card took is on its output: HIL reads no output back. An expired watchdog has put it to zero, and
/// keeps it there.
void QuanserTransport::take_voltage_away(StopReport& report) noexcept {
  const hil::Error error = card_->put_out(0.0);
  report.zero_confirmed = error >= 0;
  report.disabled = card_->enable(false) >= 0;
  if (report.zero_confirmed && report.disabled) return;
  if (has_expired() || card_->write_termination_states() >= 0) {
    report.zero_confirmed = report.disabled = true;
    return;
  }
  report.fault = error < 0 ? fault_of(error) : RigFault::line_failed;
}

StopReport QuanserTransport::stop() noexcept {
  stopped_ = true;
  if (!card_ || !rig_.quanser->output) return at_zero_volts();
  StopReport report;
  report.watchdog_s = watching_ ? card_->watchdog_s() : 0.0;
  report.watchdog_read_back = false;
  take_voltage_away(report);
  // One that has expired stays so, and is asked again by the next stop.
  if (report.done() && watching_ && !has_expired()) {
    card_->stop_watchdog();
    watching_ = false;
  }
  return report;
}

DeviceFacts QuanserTransport::device_facts() const {
  return card_ ? card_->facts() : DeviceFacts{};
}

}  // namespace upright
