// Counts what the loop's thread allocates and locks between its first cycle and its last.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <new>
#include <numbers>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "../fault/fake_hil/card_process.hpp"
#include "counted_calls.hpp"
#include "fake_comedi.hpp"
#include "hal/virtual_rig.hpp"
#include "runtime/control_loop.hpp"
#include "tests/support/real_time.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/hal/simulated_rig.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/runtime/session.hpp"

namespace upright {
namespace {

using test::allocations;
using test::armed;
using test::locks;

namespace fs = std::filesystem;

struct Counted {
  int allocations = 0;
  int locks = 0;
};

/// Arms the counters from the first read on: what comes before is set-up.
class CountingRig final : public Rig {
 public:
  CountingRig(Rig& rig, std::function<void()> in_each_cycle) : rig_(rig), extra_(std::move(in_each_cycle)) {}
  void open() override { rig_.open(); }
  RigReading read() noexcept override {
    armed = true;
    extra_();
    return rig_.read();
  }
  RigFault write(double voltage_v) noexcept override { return rig_.write(voltage_v); }
  StopReport stop() noexcept override { return rig_.stop(); }
  bool is_clock() const noexcept override { return rig_.is_clock(); }
  DeviceSample wait_next(std::int64_t until_ns) noexcept override { return rig_.wait_next(until_ns); }

 private:
  Rig& rig_;
  std::function<void()> extra_;
};

/// Runs the loop on a rig that is not open yet.
Counted count_on(Rig& plain, const RigFile& file, const ControlConfig& control, Clock& clock,
                 double duration_s, const std::function<void()>& in_each_cycle) {
  std::string folder = (fs::temp_directory_path() / "upright-XXXXXX").string();
  ::mkdtemp(folder.data());
  CountingRig rig(plain, in_each_cycle);
  rig.open();
  Counted counted;
  {
    Controller controller(control, file.amplifier.limit_v, make_model_parts(control));
    PoseScaler scaler(calibration_in_use(file));
    RunLog::Options options;
    options.queue_rows = 1024;
    RunLog log(fs::path(folder) / "samples.csv", options);
    const LoopLimits limits{static_cast<std::uint64_t>(duration_s * control.sample_rate_hz),
                            file.track_limit_m, file.fall_angle_rad, file.watchdog_s, 1'000'000};
    const SignalFlag signal{0};
    LiveStatus live;
    ControlLoop loop(rig, clock, controller, scaler, log, limits, signal, live);
    LoopOutcome outcome;
    allocations = locks = 0;
    const test::Since begin;
    loop.run(outcome);
    armed = false;
    counted = {allocations, locks};
    EXPECT_GT(outcome.counts.periods, 0u);
    EXPECT_TIMING(begin.until_now(), outcome.reason == StopReason::duration, "it balances to the end");
  }
  fs::remove_all(folder);
  return counted;
}

ControlConfig gains(const std::string& name) {
  return read_gain_file(UPRIGHT_SOURCE_DIR "/config/gains/" + name + ".yaml");
}

Counted count_in_loop(Clock& clock, double duration_s, const std::function<void()>& in_each_cycle,
                      const std::string& gain_file = "exponential") {
  RigFile file = read_rig_file(UPRIGHT_SOURCE_DIR "/config/rigs/simulated.yaml");
  file.simulated->plant = UPRIGHT_SOURCE_DIR "/config/plants/dynamic.yaml";
  file.simulated->theta_noise_rad = 1e-4;
  file.simulated->timing_jitter_s = 1e-5;
  ControlConfig control = gains(gain_file);
  control.delay_s = 0.0035;
  const auto rig = make_simulated_rig(file, clock, {1, 3.0 * std::numbers::pi / 180.0});
  return count_on(*rig, file, control, clock, duration_s, in_each_cycle);
}

TEST(RealtimeSafety, TheLoopNeitherAllocatesNorLocksInVirtualTime) {
  VirtualClock clock;
  const Counted counted = count_in_loop(clock, 20.0, [] {});
  EXPECT_EQ(counted.allocations, 0);
  EXPECT_EQ(counted.locks, 0);
}

TEST(RealtimeSafety, TheLoopNeitherAllocatesNorLocksInRealTime) {
  test::in_real_time([] {
    MonotonicClock clock;
    const Counted counted = count_in_loop(clock, 1.0, [] {});
    EXPECT_EQ(counted.allocations, 0);
    EXPECT_EQ(counted.locks, 0);
  });
}

TEST(RealtimeSafety, StateEstimatorNeitherAllocatesNorLocks) {
  for (const char* const gain_file : {"quiet", "quiet-friction"}) {
    VirtualClock clock;
    const Counted counted = count_in_loop(
        clock, 20.0, [] {}, gain_file);
    EXPECT_EQ(counted.allocations, 0) << gain_file;
    EXPECT_EQ(counted.locks, 0) << gain_file;
  }
}

TEST(RealtimeSafety, ThePredictorNeitherAllocatesNorLocks) {
  const auto count = [](Clock& clock, double duration_s) {
    const Counted counted = count_in_loop(
        clock, duration_s, [] {}, "compensated");
    EXPECT_EQ(counted.allocations, 0);
    EXPECT_EQ(counted.locks, 0);
  };
  VirtualClock virtual_clock;
  count(virtual_clock, 20.0);
  test::in_real_time([&] {
    MonotonicClock real_clock;
    count(real_clock, 1.0);
  });
}

/// The virtual rig in a thread of its own.
class ModbusServer {
 public:
  ModbusServer(const RigFile& file, double theta0_rad) {
    VirtualRigOptions options;
    options.tcp_host = "127.0.0.1";
    options.theta0_rad = theta0_rad;
    options.listening = [this](const std::string& name) { listening_.set_value(name); };
    thread_ = std::thread([this, file, options] {
      serve_virtual_rig(file, read_plant_file(UPRIGHT_SOURCE_DIR "/config/plants/exponential.yaml"), options,
                        stopped_);
    });
    const std::string name = listening_.get_future().get();
    port_ = std::stoi(name.substr(name.rfind(':') + 1));
  }
  ~ModbusServer() {
    stopped_ = true;
    thread_.join();
  }
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;
  int port() const { return port_; }

 private:
  std::promise<std::string> listening_;
  std::atomic<bool> stopped_{false};
  std::thread thread_;
  int port_ = 0;
};

RigFile patient_modbus() {
  RigFile file = read_rig_file(UPRIGHT_SOURCE_DIR "/config/rigs/modbus-tcp.yaml");
  file.modbus->response_timeout_s = 0.004;
  return file;
}

ControlConfig slow_gains() {
  ControlConfig control = gains("exponential");
  control.sample_rate_hz = 200;
  return control;
}

TEST(RealtimeSafety, TheModbusRigNeitherAllocatesNorLocks) {
  test::in_real_time([] {
    RigFile file = patient_modbus();
    const ControlConfig control = slow_gains();
    const ModbusServer server(file, 0.02);
    file.modbus->port = server.port();
    MonotonicClock clock;
    const auto rig = make_rig(file, {control.period_s()});
    const Counted counted = count_on(*rig, file, control, clock, 1.0, [] {});
    EXPECT_EQ(counted.allocations, 0);
    EXPECT_EQ(counted.locks, 0);
  });
}

/// The pendulum's counts over Modbus, the cart's and the voltage on a card: at rest, where everything is
/// zero.
TEST(RealtimeSafety, ComediAndJoinedRigsNeitherAllocateNorLock) {
  test::in_real_time([] {
    test::fake_cards()["/dev/comedi0"] = test::fake_multiq3();
    RigFile file = patient_modbus();
    const ControlConfig control = slow_gains();
    const ModbusServer server(file, 0.0);
    const RigFile card = read_rig_file(UPRIGHT_SOURCE_DIR "/config/rigs/comedi-multiq3.yaml");
    file.modbus->port = server.port();
    file.comedi = card.comedi;
    file.comedi->pendulum.reset();
    file.cart_encoder = file.output = Backend::comedi;
    file.calibration.cart = card.calibration.cart;
    file.amplifier = card.amplifier;
    MonotonicClock clock;
    const auto rig = make_rig(file, {control.period_s()});
    const Counted counted = count_on(*rig, file, control, clock, 1.0, [] {});
    EXPECT_EQ(counted.allocations, 0);
    EXPECT_EQ(counted.locks, 0);
  });
}

void expect_safe_on_card(const std::string& rig_text) {
  test::in_real_time([&] {
    const test::Folder folder;
    const test::CardProcess card(folder, rig_text);
    const RigFile file = read_rig(YamlMap::from_text(card.rig_text(), "rig.yaml"));
    const ControlConfig control = slow_gains();
    MonotonicClock clock;
    const auto rig = make_rig(file, {control.period_s()});
    const Counted counted = count_on(*rig, file, control, clock, 1.0, [] {});
    EXPECT_EQ(counted.allocations, 0);
    EXPECT_EQ(counted.locks, 0);
  });
}

TEST(RealtimeSafety, TheQuanserRigNeitherAllocatesNorLocks) {
  expect_safe_on_card(test::fake_card_rig());
}

TEST(RealtimeSafety, TheCardsClockNeitherAllocatesNorLocks) {
  expect_safe_on_card(test::on_the_cards_clock(test::fake_card_rig()));
}

// The guard itself must be able to fail.
TEST(RealtimeSafety, ASingleAllocationPerCycleIsSeen) {
  VirtualClock clock;
  const Counted counted = count_in_loop(clock, 0.1, [] {
    std::unique_ptr<int> volatile_owner = std::make_unique<int>(1);
    asm volatile("" : : "r"(volatile_owner.get()) : "memory");
  });
  EXPECT_GE(counted.allocations, 100);
  EXPECT_EQ(counted.locks, 0);
}

TEST(RealtimeSafety, ASingleLockPerCycleIsSeen) {
  VirtualClock clock;
  std::mutex mutex;
  const Counted counted =
      count_in_loop(clock, 0.1, [&mutex] { const std::lock_guard<std::mutex> guard(mutex); });
  EXPECT_GE(counted.locks, 100);
  EXPECT_EQ(counted.allocations, 0);
}

}  // namespace
}  // namespace upright
