#include "modbus_rig.hpp"

#include <linux/futex.h>
#include <pthread.h>
#include <sched.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "upright/model/error.hpp"

namespace upright {

namespace {

constexpr std::int64_t ns_per_s = 1'000'000'000;
constexpr std::int64_t first_pause_ns = 2'000'000;
constexpr std::int64_t longest_pause_ns = 100'000'000;
constexpr double connect_patience_s = 0.02;
constexpr double open_patience_s = 1.0;
constexpr double share_of_period = 0.75;  // the rest is for computing and writing
constexpr int replies_until_certain = 3;  // a single one may have a wrong bit that nothing betrays
constexpr int io_priority = 70;

std::int64_t now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * ns_per_s + now.tv_nsec;
}

/// Sleeps while `word` is `value`, until woken or until the time comes.
void wait_while(std::atomic<std::uint32_t>& word, std::uint32_t value, std::int64_t until_ns) noexcept {
  static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t));
  const timespec until{until_ns / ns_per_s, until_ns % ns_per_s};
  syscall(SYS_futex, &word, FUTEX_WAIT_BITSET_PRIVATE, value, &until, nullptr, FUTEX_BITSET_MATCH_ANY);
}

void wake(std::atomic<std::uint32_t>& word) noexcept {
  syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0);
}

const char* words_for(RigFault fault) {
  switch (fault) {
    case RigFault::link_timeout:
      return "no reply in time";
    case RigFault::link_lost:
      return "no connection";
    case RigFault::corrupt_reply:
      return "a corrupt reply";
    case RigFault::device_refused:
      return "the device refused";
    default:
      return "an unexpected answer";
  }
}

}  // namespace

ModbusTransport::ModbusTransport(const RigFile& rig, double period_s)
    : rig_(rig),
      roles_(roles_of(rig, rig.modbus->device.empty() ? Backend::modbus_tcp : Backend::modbus_rtu)),
      writes_(roles_.output || rig.modbus->exchange == ModbusExchange::read_write),
      patience_ns_(static_cast<std::int64_t>(
          1e9 * std::max(rig.modbus->response_timeout_s, share_of_period * period_s))),
      link_(rig) {}

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
  link_.close();
  throw DeviceError("check that the device at " + link_.name() + " is on, wired and configured as " +
                    rig_.file.string() + " says: " + words_for(fault) + " while " + doing);
}

void ModbusTransport::open() {
  lock_.take(link_.name());
  end_thread();
  const auto must = [&](RigFault fault, const std::string& doing) {
    if (fault != RigFault::none) fail(fault, doing);
  };
  must(link_.connect(open_patience_s), "connecting");
  // A device that has just been switched on, or a line with old bytes on it, gets a second.
  RigFault fault = RigFault::link_timeout;
  const std::int64_t until_ns = now_ns() + static_cast<std::int64_t>(1e9 * open_patience_s);
  while (fault != RigFault::none && now_ns() < until_ns) {
    if (!link_.connected()) link_.connect(open_patience_s);
    fault = link_.resynchronise(0.0);
  }
  const std::string reading_it = roles_.encoders() ? "reading the counters" : "asking for an answer";
  must(fault, reading_it);
  const ModbusRig& modbus = *rig_.modbus;
  const auto retried = [&](auto exchange, const std::string& doing) {
    const std::int64_t end_ns = now_ns() + static_cast<std::int64_t>(1e9 * open_patience_s);
    int refusals = 0;
    RigFault last = RigFault::link_lost;
    do {
      if (!link_.connected()) link_.connect(open_patience_s);
      if (!link_.in_step()) link_.resynchronise(0.0);
      last = exchange();
      if (last == RigFault::device_refused && ++refusals == replies_until_certain) break;
    } while (last != RigFault::none && now_ns() < end_ns);
    must(last, doing);
  };
  if (writes_) retried([&] { return link_.write_voltage(0.0); }, "writing zero volts");
  if (modbus.enable_address)
    retried([&] { return link_.write_register(*modbus.enable_address, 0); }, "disabling the amplifier");
  if (modbus.watchdog) {
    retried([&] { return link_.write_register(modbus.watchdog->address, modbus.watchdog->counts()); },
            "programming the device's watchdog");
    int back = 0;
    retried([&] { return link_.read_register(modbus.watchdog->address, back); },
            "reading back the device's watchdog");
    if (back != modbus.watchdog->counts()) fail(RigFault::none, "reading back the device's watchdog");
  }
  DeviceReading reading;
  retried([&] { return link_.read(0.0, reading); }, reading_it);
  boot_count_ = reading.boot_count;

  read_wanted_ = write_wanted_ = answered_ = 0;
  read_served_ = write_served_ = 0;
  voltage_v_ = 0.0;
  write_fault_ = RigFault::none;
  stopping_ = ending_ = false;
  stop_served_ = enabled_ = restarted_ = false;
  verified_ = true;
  other_boots_in_a_row_ = other_watchdogs_in_a_row_ = 0;
  checks_refused_in_a_row_ = reads_refused_in_a_row_ = writes_refused_in_a_row_ = 0;
  recoveries_ = 0;
  pause_ns_ = first_pause_ns;
  next_attempt_ns_ = 0;
  thread_ = std::thread([this] { serve(); });
  const sched_param parameters{io_priority};
  pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &parameters);  // where allowed
}

void ModbusTransport::ring() noexcept {
  doorbell_.fetch_add(1, std::memory_order_release);
  wake(doorbell_);
}

RigReading ModbusTransport::read() noexcept {
  const std::int64_t until_ns = now_ns() + patience_ns_;
  const std::uint32_t number = read_wanted_.load(std::memory_order_relaxed) + 1;
  read_wanted_.store(number, std::memory_order_release);
  ring();
  for (;;) {
    const std::uint32_t answered = answered_.load(std::memory_order_acquire);
    if (answered == number) return reading_;
    if (now_ns() >= until_ns) break;
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
  write_wanted_.fetch_add(1, std::memory_order_release);
  ring();
  return std::isfinite(voltage_v) ? write_fault_.load(std::memory_order_relaxed) : RigFault::not_finite;
}

void ModbusTransport::stop() noexcept {
  voltage_v_.store(0.0);
  stopping_.store(true);
  ring();
}

void ModbusTransport::serve() noexcept {
  for (;;) {
    const std::uint32_t rung = doorbell_.load(std::memory_order_acquire);
    if (stopping_.load() && !stop_served_) serve_stop();
    if (write_wanted_.load(std::memory_order_acquire) != write_served_) serve_write();
    const std::uint32_t wanted = read_wanted_.load(std::memory_order_acquire);
    if (wanted != read_served_) serve_read(wanted);
    if (ending_.load()) break;
    wait_while(doorbell_, rung, now_ns() + ns_per_s);
  }
  link_.close();
}

/// Connected, in step, and the device is the one we programmed; or why not. One attempt at most.
RigFault ModbusTransport::ready() noexcept {
  if (restarted_) return RigFault::device_restarted;
  if (!link_.connected()) {
    if (now_ns() < next_attempt_ns_) return RigFault::link_lost;
    if (const RigFault fault = link_.connect(connect_patience_s); fault != RigFault::none) {
      next_attempt_ns_ = now_ns() + pause_ns_;
      pause_ns_ = std::min(2 * pause_ns_, longest_pause_ns);
      return fault;
    }
    verified_ = false;
  }
  if (!link_.in_step()) {
    verified_ = false;
    if (const RigFault fault = link_.resynchronise(voltage_v_.load()); fault != RigFault::none) return fault;
  }
  if (!verified_) {
    const RigFault fault = certain(verify(), checks_refused_in_a_row_);
    if (fault != RigFault::none) return fault;
    verified_ = true;
    ++recoveries_;
  }
  pause_ns_ = first_pause_ns;
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
    const std::int64_t asked_ns = now_ns();
    answer.fault = certain(link_.read(voltage_v_.load(), reading), reads_refused_in_a_row_);
    answer.time_ns = asked_ns + (now_ns() - asked_ns) / 2;
    if (answer.fault == RigFault::none) answer.fault = same_device(reading);
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
  wake(answered_);
}

void ModbusTransport::serve_write() noexcept {
  write_served_ = write_wanted_.load(std::memory_order_acquire);
  RigFault fault = ready();
  if (fault == RigFault::none && !stopping_.load()) {
    fault = link_.write_voltage(voltage_v_.load());
    if (fault == RigFault::none && !enabled_ && rig_.modbus->enable_address) {
      fault = link_.write_register(*rig_.modbus->enable_address, 1);
      enabled_ = fault == RigFault::none;
    }
    fault = certain(fault, writes_refused_in_a_row_);
  }
  write_fault_.store(fault, std::memory_order_relaxed);
}

/// Zero volts and the amplifier off, tried for as long as the watchdog would take; a device that cannot be
/// reached by then has its own.
void ModbusTransport::serve_stop() noexcept {
  stop_served_ = true;
  const std::int64_t until_ns = now_ns() + static_cast<std::int64_t>(rig_.watchdog_s * 1e9);
  for (;;) {
    RigFault fault = link_.connected() ? RigFault::none : link_.connect(connect_patience_s);
    if (fault == RigFault::none && !link_.in_step()) fault = link_.resynchronise(0.0);
    if (fault == RigFault::none && writes_) fault = link_.write_voltage(0.0);
    if (fault == RigFault::none && rig_.modbus->enable_address)
      fault = link_.write_register(*rig_.modbus->enable_address, 0);
    if (fault == RigFault::none || now_ns() > until_ns) return;
    timespec pause{0, first_pause_ns};
    nanosleep(&pause, nullptr);
  }
}

}  // namespace upright
