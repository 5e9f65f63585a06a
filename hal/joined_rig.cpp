#include "joined_rig.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace upright {

namespace {

constexpr double max_skew_periods = 0.5;

bool of_link(RigFault fault) noexcept {
  return fault == RigFault::link_timeout || fault == RigFault::link_lost ||
         fault == RigFault::corrupt_reply || fault == RigFault::device_busy;
}

struct Part {
  std::unique_ptr<Rig> rig;
  RigRoles roles;
  std::uint64_t sequence = 0;  // of its last fresh reading
};

class JoinedRig final : public Rig {
 public:
  JoinedRig(std::vector<RigPart> parts, double period_s)
      : max_skew_ns_(static_cast<std::int64_t>(1e9 * max_skew_periods * period_s)) {
    std::stable_partition(parts.begin(), parts.end(), [](const RigPart& part) { return part.roles.output; });
    for (RigPart& part : parts) parts_.push_back({std::move(part.rig), part.roles, 0});
  }

  void open() override {
    try {
      for (Part& part : parts_) {
        part.rig->open();
        part.sequence = 0;
      }
    } catch (...) {
      stop();
      throw;
    }
    sequence_ = 0;
  }

  RigReading read() noexcept override {
    RigReading reading;
    reading.status = RigStatus::fresh;
    std::int64_t cart_ns = 0, pendulum_ns = 0;
    for (Part& part : parts_) {
      const RigReading of_part = read_part(part);
      worsen(reading, of_part.status, of_part.fault);
      reading.recoveries += of_part.recoveries;
      if (part.roles.cart) {
        reading.cart_counts = of_part.cart_counts;
        reading.cart_counts_per_s = of_part.cart_counts_per_s;
        cart_ns = of_part.time_ns;
      }
      if (part.roles.pendulum) {
        reading.pendulum_counts = of_part.pendulum_counts;
        reading.pendulum_counts_per_s = of_part.pendulum_counts_per_s;
        pendulum_ns = of_part.time_ns;
      }
    }
    reading.time_ns = std::min(cart_ns, pendulum_ns);
    if (std::abs(cart_ns - pendulum_ns) > max_skew_ns_)
      worsen(reading, RigStatus::stale, RigFault::link_timeout);
    if (reading.status == RigStatus::fresh) reading.sequence = ++sequence_;
    return reading;
  }

  RigFault write(double voltage_v) noexcept override { return parts_.front().rig->write(voltage_v); }

  /// Only the output has a voltage to take away.
  StopReport stop() noexcept override {
    const StopReport of_output = parts_.front().rig->stop();
    for (std::size_t i = 1; i < parts_.size(); ++i) parts_[i].rig->stop();
    return of_output;
  }

  DeviceFacts device_facts() const override {
    DeviceFacts all;
    for (const Part& part : parts_)
      for (DeviceFacts::value_type& fact : part.rig->device_facts()) all.push_back(std::move(fact));
    return all;
  }

  bool measures_velocities() const noexcept override {
    return std::all_of(parts_.begin(), parts_.end(), [](const Part& part) {
      return !(part.roles.cart || part.roles.pendulum) || part.rig->measures_velocities();
    });
  }
  bool is_clock() const noexcept override { return clock_part() != nullptr; }
  DeviceSample wait_next(std::int64_t until_ns) noexcept override {
    Rig* const clock = clock_part();
    return clock == nullptr ? DeviceSample{} : clock->wait_next(until_ns);
  }

  int last_exception() const noexcept override {
    for (const Part& part : parts_)
      if (const int number = part.rig->last_exception(); number != 0) return number;
    return 0;
  }

 private:
  /// The part whose device is the clock; null: none.
  Rig* clock_part() const noexcept {
    for (const Part& part : parts_)
      if (part.rig->is_clock()) return part.rig.get();
    return nullptr;
  }

  static RigReading read_part(Part& part) noexcept {
    RigReading reading = part.rig->read();
    if (reading.status != RigStatus::fresh) return reading;
    if (reading.sequence == part.sequence) {
      reading.status = RigStatus::stale;
      reading.fault = RigFault::link_timeout;
    }
    part.sequence = reading.sequence;
    return reading;
  }

  /// Keeps the worse of two. Of two faults a link's, which may pass, gives way to one that does not.
  static void worsen(RigReading& reading, RigStatus status, RigFault fault) noexcept {
    const bool graver = status == RigStatus::fault && of_link(reading.fault) && !of_link(fault);
    if (status < reading.status || (status == reading.status && !graver)) return;
    reading.status = status;
    reading.fault = fault;
  }

  std::vector<Part> parts_;  // the output's first
  std::int64_t max_skew_ns_;
  std::uint64_t sequence_ = 0;
};

}  // namespace

std::unique_ptr<Rig> joined(std::vector<RigPart> parts, double period_s) {
  return std::make_unique<JoinedRig>(std::move(parts), period_s);
}

}  // namespace upright
