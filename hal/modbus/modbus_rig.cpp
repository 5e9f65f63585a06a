#include "modbus_rig.hpp"

#include <pthread.h>
#include <sched.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <system_error>

#include "hal/modbus_exception.hpp"
#include "hal/reading_patience.hpp"
#include "hal/voltage_freshness.hpp"
#include "hal/word_wait.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/clock.hpp"

namespace upright {

namespace {

constexpr std::int64_t first_connect_pause_ns = 2'000'000;
constexpr std::int64_t longest_connect_pause_ns = 100'000'000;
constexpr double connect_patience_s = 0.02;
constexpr double open_patience_s = 1.0;
constexpr int replies_until_certain = 3;  // a single one may have a wrong bit that nothing betrays
constexpr int io_priority = 70;
/// A loop that has computed no voltage by then is late. The request for the next sample must not be: its
/// bytes take the rest of the period.
constexpr double computing_share_of_period = 0.5;

const char* words_for(RigFault fault) {
  switch (fault) {
    case RigFault::link_timeout:
      return "no reply in time";
    case RigFault::link_lost:
      return "no connection";
    case RigFault::corrupt_reply:
      return "a reply that does not match the request";
    default:
      return "an unexpected answer";
  }
}

}  // namespace

ModbusTransport::ModbusTransport(const RigFile& rig, double period_s)
    : rig_(rig),
      roles_(roles_of(rig, rig.modbus->device.empty() ? Backend::modbus_tcp : Backend::modbus_rtu)),
      writes_(roles_.output || rig.modbus->exchange == ModbusExchange::read_write),
      period_s_(period_s),
      patience_ns_(static_cast<std::int64_t>(
          1e9 * std::max(rig.modbus->response_timeout_s, reading_share_of_period * period_s))),
      freshness_ns_(static_cast<std::int64_t>(1e9 * freshness_periods * period_s)),
      link_(rig),
      stop_sequence_(link_, *rig_.modbus) {}

ModbusTransport::~ModbusTransport() {
  end_thread();
}

void ModbusTransport::end_thread() noexcept {
  if (!thread_.joinable()) return;
  stop();
  ending_.store(true);
  ring();
  thread_.join();
}

void ModbusTransport::fail(RigFault fault, const std::string& doing) {
  const int exception = link_.last_exception();
  link_.close();
  const std::string device = "the device at " + link_.name(), file = rig_.file.string();
  if (fault == RigFault::device_refused)
    throw DeviceError(device + " refused with " + exception_text(exception) + " while " + doing +
                      ": check that it supports the addresses and functions in " + file);
  if (fault == RigFault::device_busy)
    throw DeviceError(device + " answered with " + exception_text(exception) + " while " + doing +
                      ": check that no other master uses it, and the devices behind it");
  if (fault == RigFault::output_kept)
    throw DeviceError(
        device +
        " acknowledged zero volts, but its output reads back as another voltage: switch "
        "the amplifier off and check the device; if that register does not show the output, set "
        "modbus.voltage.read_back to false in " +
        file);
  if (fault == RigFault::edges_lost)
    throw DeviceError(
        device +
        " has lost encoder edges, so its counts are wrong: check the wiring and the speed of the "
        "encoders, then restart the device");
  throw DeviceError(std::string(words_for(fault)) + " from " + device + " while " + doing +
                    ": check that the device is on, and that its wiring and settings match " + file);
}

/// An exchange of open(), until it succeeds; a device that has just been switched on gets a second.
template <class Exchange>
void ModbusTransport::retried(Exchange exchange, const std::string& doing) {
  const std::int64_t end_ns = monotonic_ns() + static_cast<std::int64_t>(1e9 * open_patience_s);
  int refusals = 0;
  RigFault last = RigFault::link_lost;
  for (;;) {
    if (!link_.connected()) link_.connect(open_patience_s);
    if (!link_.in_step()) link_.resynchronise(0.0);
    last = exchange();
    if (last == RigFault::none) return;
    if (last == RigFault::device_refused && ++refusals == replies_until_certain) break;
    if (monotonic_ns() >= end_ns) break;
    const timespec pause{0, first_connect_pause_ns};
    nanosleep(&pause, nullptr);
  }
  fail(last, doing);
}

/// True: the device lets its voltage registers be read, and they hold zero volts.
bool ModbusTransport::offers_read_back() {
  if (!roles_.output || !rig_.modbus->voltage_reads_back) return false;
  bool offers = false;
  RigFault last = RigFault::none;
  const auto read_zero = [&] {
    double voltage_v = 0.0;
    last = link_.read_voltage(voltage_v);
    offers = last == RigFault::none;
    // One that takes its time may show zero the next time.
    if (offers && voltage_v != 0.0) return RigFault::output_kept;
    return last;
  };
  try {
    retried(read_zero, "reading the voltage back");
  } catch (const DeviceError&) {
    if (offers) throw;
    // It refuses to have it read, or does not answer such a request at all: what it acknowledges must do.
    if (last == RigFault::device_busy) throw;
    return false;
  }
  return true;
}

/// Zero volts, amplifier off, and the device's own watchdog as the file says.
void ModbusTransport::prepare_device() {
  const ModbusRig& modbus = *rig_.modbus;
  if (writes_) retried([&] { return link_.write_voltage(0.0); }, "writing zero volts");
  if (modbus.enable_address)
    retried([&] { return link_.write_register(*modbus.enable_address, 0); }, "disabling the amplifier");
  reads_back_ = offers_read_back();
  if (modbus.sampling) {
    const int address = modbus.sampling->period_address, counts = modbus.sampling->counts(period_s_).value();
    retried([&] { return link_.write_register(address, counts); }, "programming the device's sample period");
    require_register(address, counts, "reading back the device's sample period");
  }
  if (!modbus.watchdog) return;
  retried([&] { return link_.write_register(modbus.watchdog->address, modbus.watchdog->counts()); },
          "programming the device's watchdog");
  require_register(modbus.watchdog->address, modbus.watchdog->counts(), "reading back the device's watchdog");
}

/// Throws DeviceError if the device holds another number there.
void ModbusTransport::require_register(int address, int counts, const std::string& doing) {
  int back = 0;
  retried([&] { return link_.read_register(address, back); }, doing);
  if (back != counts) fail(RigFault::none, doing);
}

/// Throws DeviceError where the user cannot open the serial line at all, which no waiting helps.
void ModbusTransport::require_line() const {
  const std::string& line = rig_.modbus->device;
  if (line.empty() || ::access(line.c_str(), R_OK | W_OK) == 0) return;
  const int problem = errno;
  throw DeviceError(
      "the serial line " + line + " of " + rig_.file.string() + " cannot be opened (" +
      std::error_code(problem, std::generic_category()).message() + "): " +
      (problem == EACCES
           ? "add yourself to the group that owns it (on Debian: sudo adduser $USER dialout), and "
             "log in again"
           : "connect the device, or set modbus.device to its line (ls /dev/ttyACM* /dev/ttyUSB*)"));
}

void ModbusTransport::open() {
  lock_.take(link_.name());
  require_line();
  end_thread();
  stop_sequence_.reset(false, 0.0);
  if (const RigFault fault = link_.connect(open_patience_s); fault != RigFault::none)
    fail(fault, "connecting");
  const std::string reading_it = roles_.encoders() ? "reading the counters" : "requesting a reply";
  // A device that has just been switched on, or a line with old bytes on it, gets a second.
  retried([&] { return link_.resynchronise(0.0); }, reading_it);
  prepare_device();
  DeviceReading reading;
  retried([&] { return link_.read(0.0, reading); }, reading_it);
  if (is_clock())
    retried([&] { return link_.read_next(0.0, period_s_, reading); }, "waiting for its next sample");
  boot_count_ = reading.boot_count;
  begin_serving();
}

void ModbusTransport::begin_serving() {
  const auto& watchdog = rig_.modbus->watchdog;
  stop_sequence_.reset(reads_back_, watchdog ? watchdog->time_s : 0.0);
  read_wanted_ = write_wanted_ = answered_ = 0;
  read_served_ = write_served_ = 0;
  voltage_v_ = 0.0;
  write_fault_ = stop_fault_ = RigFault::none;
  exception_ = stop_exception_ = 0;
  stopping_ = ending_ = false;
  zero_confirmed_ = read_back_ = false;
  disabled_ = stop_sequence_.report().disabled;
  enabled_ = restarted_ = false;
  verified_ = true;
  other_boots_in_a_row_ = other_watchdogs_in_a_row_ = 0;
  checks_refused_in_a_row_ = reads_refused_in_a_row_ = writes_refused_in_a_row_ = 0;
  recoveries_ = 0;
  samples_.publish({});
  sample_reader_ = {};
  next_sample_ns_ = monotonic_ns();
  pause_ns_ = first_connect_pause_ns;
  next_attempt_ns_ = stop_begun_ns_ = 0;
  thread_ = std::thread([this] { serve(); });
  const sched_param parameters{io_priority};
  pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &parameters);  // where allowed
}

void ModbusTransport::ring() noexcept {
  doorbell_.fetch_add(1, std::memory_order_release);
  wake_one(doorbell_);
}

DeviceSample ModbusTransport::wait_next(std::int64_t until_ns) noexcept {
  return sample_reader_.wait_next(samples_, until_ns);
}

RigReading ModbusTransport::newest_sample() noexcept {
  const RingSample sample = samples_.latest();
  RigReading reading;
  reading.time_ns = sample.when.time_ns;
  reading.recoveries = recoveries_.load(std::memory_order_relaxed);
  if (!sample_reader_.is_new(sample)) {
    reading.fault = sample.trouble != 0 ? static_cast<RigFault>(sample.trouble) : RigFault::link_timeout;
    return reading;
  }
  reading.sequence = sample.when.number;
  reading.cart_counts = sample.cart;
  reading.pendulum_counts = sample.pendulum;
  reading.status = RigStatus::fresh;
  return reading;
}

RigReading ModbusTransport::read() noexcept {
  if (is_clock()) return newest_sample();
  const std::int64_t until_ns = monotonic_ns() + patience_ns_;
  const std::uint32_t number = read_wanted_.load(std::memory_order_relaxed) + 1;
  read_wanted_.store(number, std::memory_order_release);
  ring();
  for (;;) {
    const std::uint32_t answered = answered_.load(std::memory_order_acquire);
    if (answered == number) return reading_;
    if (monotonic_ns() >= until_ns) break;
    wait_while(answered_, answered, until_ns);
  }
  // The thread may still be writing reading_, so nothing of it is shown.
  RigReading late;
  late.status = RigStatus::stale;
  late.fault = RigFault::link_timeout;
  return late;
}

RigFault ModbusTransport::write(double voltage_v) noexcept {
  if (!roles_.output) return RigFault::device_refused;
  if (stopping_.load(std::memory_order_relaxed)) return RigFault::none;
  voltage_v_.store(safe_voltage(voltage_v, rig_.amplifier.limit_v), std::memory_order_relaxed);
  commanded_ns_.store(monotonic_ns(), std::memory_order_release);
  write_wanted_.fetch_add(1, std::memory_order_release);
  ring();
  return std::isfinite(voltage_v) ? write_fault_.load(std::memory_order_relaxed) : RigFault::not_finite;
}

StopReport ModbusTransport::stop() noexcept {
  voltage_v_.store(0.0);
  if (!stopping_.exchange(true)) ring();
  if (!roles_.output) return at_zero_volts();
  StopReport report;
  report.zero_confirmed = zero_confirmed_.load(std::memory_order_acquire);
  report.read_back = read_back_.load(std::memory_order_relaxed);
  report.disabled = disabled_.load(std::memory_order_relaxed);
  report.watchdog_s = rig_.modbus->watchdog ? rig_.modbus->watchdog->time_s : 0.0;
  report.fault = stop_fault_.load(std::memory_order_relaxed);
  report.exception = stop_exception_.load(std::memory_order_relaxed);
  return report;
}

/// True as long as zero volts is to be tried for.
bool ModbusTransport::stop_is_due() const noexcept {
  return stopping_.load() && roles_.output && !stop_sequence_.report().done();
}

void ModbusTransport::serve() noexcept {
  for (;;) {
    const std::uint32_t rung = doorbell_.load(std::memory_order_acquire);
    if (stop_is_due() && monotonic_ns() >= stop_sequence_.next_ns()) serve_stop();
    if (is_clock()) {
      if (sample_is_due()) serve_sample();
    } else if (write_wanted_.load(std::memory_order_acquire) != write_served_) {
      serve_write();
    }
    const std::uint32_t wanted = read_wanted_.load(std::memory_order_acquire);
    if (wanted != read_served_) serve_read(wanted);
    if (ending_.load()) {
      // Whoever wanted to know has asked by now.
      const auto patience_ns = static_cast<std::int64_t>(1e9 * rig_.watchdog_s);
      if (!stop_is_due() || monotonic_ns() > stop_begun_ns_ + patience_ns) break;
    }
    wait_while(doorbell_, rung, next_ns());
  }
  link_.close();
}

/// When the thread has something to do, if nothing is asked of it before.
std::int64_t ModbusTransport::next_ns() const noexcept {
  if (stop_is_due()) return stop_sequence_.next_ns();
  return is_clock() && !stopping_.load() ? next_sample_ns_ : monotonic_ns() + nanoseconds_per_second;
}

bool ModbusTransport::voltage_is_fresh() const noexcept {
  return monotonic_ns() - commanded_ns_.load(std::memory_order_acquire) <= freshness_ns_;
}

/// What an exchange may carry that was not asked for to write.
double ModbusTransport::fresh_voltage_v() const noexcept {
  return voltage_is_fresh() ? voltage_v_.load() : 0.0;
}

/// Keeps the number of an exception for whoever names the fault.
RigFault ModbusTransport::noted(RigFault fault) noexcept {
  if (fault != RigFault::none) exception_.store(link_.last_exception(), std::memory_order_relaxed);
  return fault;
}

/// Connected, in step, and the device is the one we programmed; or why not. One attempt at most.
RigFault ModbusTransport::ready() noexcept {
  if (restarted_) return RigFault::device_restarted;
  if (!link_.connected()) {
    if (monotonic_ns() < next_attempt_ns_) return RigFault::link_lost;
    if (const RigFault fault = link_.connect(connect_patience_s); fault != RigFault::none) {
      next_attempt_ns_ = monotonic_ns() + pause_ns_;
      pause_ns_ = std::min(2 * pause_ns_, longest_connect_pause_ns);
      return fault;
    }
    verified_ = false;
  }
  if (!link_.in_step()) {
    verified_ = false;
    if (const RigFault fault = link_.resynchronise(fresh_voltage_v()); fault != RigFault::none)
      return noted(fault);
  }
  if (!verified_) {
    const RigFault fault = certain(noted(verify()), checks_refused_in_a_row_);
    if (fault != RigFault::none) return fault;
    verified_ = true;
    ++recoveries_;
  }
  pause_ns_ = first_connect_pause_ns;
  return RigFault::none;
}

/// What a reply means that does not come from the device we programmed.
RigFault ModbusTransport::other_device(int& in_a_row) noexcept {
  if (++in_a_row < replies_until_certain) return RigFault::corrupt_reply;
  restarted_ = true;
  return RigFault::device_restarted;
}

/// An exception is a refusal when it comes again and again.
RigFault ModbusTransport::certain(RigFault fault, int& refusals_in_a_row) noexcept {
  if (fault == RigFault::none) refusals_in_a_row = 0;
  if (fault != RigFault::device_refused) return fault;
  return ++refusals_in_a_row < replies_until_certain ? RigFault::corrupt_reply : fault;
}

/// A device that restarted has forgotten its watchdog's time.
RigFault ModbusTransport::verify() noexcept {
  if (!rig_.modbus->watchdog) return RigFault::none;
  int counts = 0;
  const RigFault fault = link_.read_register(rig_.modbus->watchdog->address, counts);
  if (fault != RigFault::none) return fault;
  if (counts != rig_.modbus->watchdog->counts()) return other_device(other_watchdogs_in_a_row_);
  other_watchdogs_in_a_row_ = 0;
  return RigFault::none;
}

/// A device with another boot count restarted.
RigFault ModbusTransport::same_device(const DeviceReading& reading) noexcept {
  if (reading.boot_count != boot_count_) return other_device(other_boots_in_a_row_);
  other_boots_in_a_row_ = 0;
  return RigFault::none;
}

void ModbusTransport::serve_read(std::uint32_t number) noexcept {
  RigReading answer;
  answer.fault = ready();
  if (answer.fault == RigFault::none) {
    DeviceReading reading;
    const std::int64_t asked_ns = monotonic_ns();
    answer.fault = certain(noted(link_.read(fresh_voltage_v(), reading)), reads_refused_in_a_row_);
    answer.time_ns = asked_ns + (monotonic_ns() - asked_ns) / 2;
    if (answer.fault == RigFault::none) answer.fault = same_device(reading);
    if (answer.fault == RigFault::none) answer.fault = reading.stopped_by;
    if (answer.fault == RigFault::none) {
      answer.cart_counts = signed_counts(reading.cart_counts, rig_.calibration.cart.width_bits);
      answer.pendulum_counts = signed_counts(reading.pendulum_counts, rig_.calibration.pendulum.width_bits);
      answer.sequence = ++sequence_;
      answer.status = RigStatus::fresh;
    }
  }
  answer.recoveries = recoveries_;
  read_served_ = number;
  reading_ = answer;
  answered_.store(number, std::memory_order_release);
  wake_one(answered_);
}

/// The voltage of the sample before goes out with the request for the next one, so that is asked for as soon
/// as the voltage is there, or must be without it.
bool ModbusTransport::sample_is_due() const noexcept {
  if (stopping_.load()) return false;
  return write_wanted_.load(std::memory_order_acquire) != write_served_ || monotonic_ns() >= next_sample_ns_;
}

void ModbusTransport::serve_sample() noexcept {
  RingSample sample = samples_.latest();
  const RigFault fault = take_sample(sample);
  sample.trouble = static_cast<std::int32_t>(fault);
  write_fault_.store(fault, std::memory_order_relaxed);
  next_sample_ns_ = monotonic_ns() + static_cast<std::int64_t>(1e9 * computing_share_of_period * period_s_);
  samples_.publish(sample);
}

RigFault ModbusTransport::take_sample(RingSample& sample) noexcept {
  const std::uint32_t wanted = write_wanted_.load(std::memory_order_acquire);
  const bool is_first_voltage = wanted != write_served_ && !enabled_ && rig_.modbus->enable_address;
  write_served_ = wanted;
  if (const RigFault fault = ready(); fault != RigFault::none) return fault;
  if (is_first_voltage)
    if (const RigFault fault = send_voltage(); fault != RigFault::none) return fault;
  DeviceReading reading;
  const RigFault fault =
      certain(noted(link_.read_next(fresh_voltage_v(), period_s_, reading)), reads_refused_in_a_row_);
  const std::int64_t arrived_ns = monotonic_ns();
  if (fault != RigFault::none) {
    // A device that restarted has forgotten its sample period, and refuses.
    verified_ = false;
    return fault;
  }
  if (const RigFault other = same_device(reading); other != RigFault::none) return other;
  if (reading.stopped_by != RigFault::none) return reading.stopped_by;
  sample.when = {sample.when.number + 1, arrived_ns};
  sample.cart = signed_counts(reading.cart_counts, rig_.calibration.cart.width_bits);
  sample.pendulum = signed_counts(reading.pendulum_counts, rig_.calibration.pendulum.width_bits);
  return RigFault::none;
}

void ModbusTransport::serve_write() noexcept {
  write_served_ = write_wanted_.load(std::memory_order_acquire);
  RigFault fault = ready();
  if (fault == RigFault::none && !stopping_.load()) fault = send_voltage();
  write_fault_.store(fault, std::memory_order_relaxed);
}

/// The voltage that was asked for, unless it has become old on the way.
RigFault ModbusTransport::send_voltage() noexcept {
  if (!voltage_is_fresh()) return RigFault::link_timeout;
  RigFault fault = noted(link_.write_voltage(voltage_v_.load()));
  if (fault == RigFault::none && !enabled_ && rig_.modbus->enable_address) {
    fault = noted(link_.write_register(*rig_.modbus->enable_address, 1));
    enabled_ = fault == RigFault::none;
  }
  return certain(fault, writes_refused_in_a_row_);
}

void ModbusTransport::serve_stop() noexcept {
  if (stop_begun_ns_ == 0) stop_begun_ns_ = monotonic_ns();
  stop_sequence_.attempt();
  const StopReport& report = stop_sequence_.report();
  stop_fault_.store(report.fault, std::memory_order_relaxed);
  stop_exception_.store(report.exception, std::memory_order_relaxed);
  read_back_.store(report.read_back, std::memory_order_relaxed);
  disabled_.store(report.disabled, std::memory_order_relaxed);
  zero_confirmed_.store(report.zero_confirmed, std::memory_order_release);
}

}  // namespace upright
