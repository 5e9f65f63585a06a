#include "guarded_rig.hpp"

#include <utility>

namespace upright {

namespace {

constexpr int jumps_until_lost = 3;

class GuardedRig final : public Rig {
 public:
  GuardedRig(std::unique_ptr<Rig> rig, const Calibration& calibration)
      : rig_(std::move(rig)), calibration_(calibration) {}

  void open() override {
    rig_->open();
    have_last_ = lost_ = false;
    jumps_ = 0;
  }
  RigFault write(double voltage_v) noexcept override { return rig_->write(voltage_v); }
  StopReport stop() noexcept override { return rig_->stop(); }
  void moved_by_hand() noexcept override {
    have_last_ = false;
    rig_->moved_by_hand();
  }
  int last_exception() const noexcept override { return rig_->last_exception(); }
  SafetyInputs safety_inputs() const noexcept override { return rig_->safety_inputs(); }
  DeviceFacts device_facts() const override { return rig_->device_facts(); }
  bool measures_velocities() const noexcept override { return rig_->measures_velocities(); }
  bool is_clock() const noexcept override { return rig_->is_clock(); }
  DeviceSample wait_next(std::int64_t until_ns) noexcept override { return rig_->wait_next(until_ns); }

  RigReading read() noexcept override {
    RigReading reading = rig_->read();
    if (reading.status != RigStatus::fresh) return reading;
    if (lost_ || implausible(reading)) return refused(reading);
    jumps_ = 0;
    have_last_ = true;
    last_ = reading;
    return reading;
  }

 private:
  bool implausible(const RigReading& reading) const noexcept {
    if (!have_last_) return false;
    const double elapsed_s = static_cast<double>(reading.time_ns - last_.time_ns) * 1e-9;
    return implausible_step(last_.cart_counts, reading.cart_counts, elapsed_s, calibration_.cart) ||
           implausible_step(last_.pendulum_counts, reading.pendulum_counts, elapsed_s, calibration_.pendulum);
  }

  RigReading refused(RigReading reading) noexcept {
    lost_ = lost_ || ++jumps_ >= jumps_until_lost;
    reading.status = RigStatus::fault;
    reading.fault = lost_ ? RigFault::counts_jumped : RigFault::corrupt_reply;
    return reading;
  }

  std::unique_ptr<Rig> rig_;
  Calibration calibration_;
  RigReading last_;
  int jumps_ = 0;
  bool have_last_ = false, lost_ = false;
};

}  // namespace

std::unique_ptr<Rig> guarded(std::unique_ptr<Rig> rig, const Calibration& calibration) {
  return std::make_unique<GuardedRig>(std::move(rig), calibration);
}

}  // namespace upright
