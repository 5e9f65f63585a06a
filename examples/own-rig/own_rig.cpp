// A rig backend of one's own: a class between the control loop and the library of a card. The loop gets zero
// volts, checks and logs from upright, as every backend does. Calibration and limits come from a rig file.
//   own_rig RIG GAINS PLANT
#include <cmath>
#include <iostream>

#include "card.hpp"
#include "upright/base/error.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/runtime/session.hpp"

namespace {

/// include/upright/hal/rig.hpp says what each function owes the loop: none may allocate, lock, throw or wait.
class CardRig final : public upright::Rig {
 public:
  CardRig(const char* name, upright::Clock& clock, int sign) : name_(name), clock_(clock), sign_(sign) {}
  ~CardRig() override { close(); }
  CardRig(const CardRig&) = delete;
  CardRig& operator=(const CardRig&) = delete;

  void open() override {
    close();
    start_ns_ = clock_.now_ns();
    card_ = card_open(name_);
    if (card_ == nullptr)
      throw upright::DeviceError(std::string("there is no card ") + name_ + ": check its name");
    if (!stop().done()) throw upright::DeviceError("the card does not take zero volts: check its cable");
  }
  upright::RigReading read() noexcept override {
    upright::RigReading reading;
    std::int64_t counts[2];
    reading.time_ns = clock_.now_ns();
    if (!card_read_encoders(card_, seconds(), counts)) {
      reading.fault = upright::RigFault::link_lost;  // its status is a fault unless something else is said
      return reading;
    }
    reading.cart_counts = counts[0];
    reading.pendulum_counts = counts[1];
    reading.sequence = ++sequence_;
    reading.status = upright::RigStatus::fresh;
    return reading;
  }
  upright::RigFault write(double voltage_v) noexcept override {
    const bool finite = std::isfinite(voltage_v);
    if (!card_write_volts(card_, seconds(), finite ? sign_ * voltage_v : 0.0))
      return upright::RigFault::link_lost;
    return finite ? upright::RigFault::none : upright::RigFault::not_finite;
  }
  upright::StopReport stop() noexcept override {
    upright::StopReport report;
    report.fault = write(0.0);
    report.zero_confirmed = report.fault == upright::RigFault::none;
    return report;
  }

 private:
  double seconds() const noexcept { return static_cast<double>(clock_.now_ns() - start_ns_) * 1e-9; }
  void close() {
    if (card_ != nullptr) card_close(card_);
    card_ = nullptr;
  }

  const char* name_;
  upright::Clock& clock_;
  int sign_;
  Card* card_ = nullptr;
  std::int64_t start_ns_ = 0;
  std::uint64_t sequence_ = 0;
};

int balance(const char* rig_file, const char* gain_file, const char* plant_file) {
  upright::RunSetup setup;
  setup.label = "own-rig";
  setup.duration_s = 10.0;
  setup.fast = true;
  setup.rig = upright::read_rig_file(rig_file);
  setup.control = upright::read_gain_file(gain_file);
  setup.limits = upright::rig_limits(setup.rig, std::nullopt);
  setup.limits.periods = static_cast<std::uint64_t>(setup.duration_s * setup.control.sample_rate_hz);
  setup.limits.max_periods_late = upright::default_periods_late(setup.control.period_s());

  upright::VirtualClock clock;  // a real card needs upright::MonotonicClock
  const auto rig =
      upright::assembled(std::make_unique<CardRig>(plant_file, clock, setup.rig.amplifier.sign), setup.rig);
  rig->open();
  upright::SessionOptions options;
  options.parts = upright::make_model_parts(setup.control);
  const upright::SignalFlag no_signal{0};
  const upright::LoopLimits limits = setup.limits;
  const upright::SessionResult result =
      upright::run_session(std::move(setup), *rig, clock, no_signal, std::move(options));
  std::cout << upright::sentence_of(result.outcome, limits, result.log) << "\n"
            << result.directory.string() << "\n";
  return result.outcome.reason == upright::StopReason::duration ? 0 : 3;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: own_rig RIG GAINS PLANT\n";
    return 2;
  }
  try {
    return balance(argv[1], argv[2], argv[3]);
  } catch (const upright::Error& error) {
    std::cerr << "own_rig: " << error.what() << "\n";
    return static_cast<int>(error.code());
  }
}
