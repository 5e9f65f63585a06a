// The loop's thread, the log's two, the link's and the virtual rig's server in one process, with and without
// faults: for the thread sanitizer, which sees only one process.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <future>
#include <string>
#include <thread>

#include "hal/virtual_rig.hpp"
#include "runtime/wait_upright.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/record/run_reader.hpp"
#include "upright/runtime/session.hpp"
#include "virtual_rig_process.hpp"

namespace upright::test {
namespace {

const std::string config = UPRIGHT_SOURCE_DIR "/config/";

/// The virtual rig in a thread of its own.
class Server {
 public:
  Server(const RigFile& rig, VirtualRigOptions options) : rig_(rig), options_(std::move(options)) {
    std::promise<std::string> listening;
    std::future<std::string> name = listening.get_future();
    options_.listening = [&listening](const std::string& text) { listening.set_value(text); };
    thread_ = std::thread([this] {
      serve_virtual_rig(rig_, read_plant_file(config + "plants/exponential.yaml"), options_, stopped_);
    });
    name_ = name.get();
  }
  ~Server() {
    stopped_ = true;
    thread_.join();
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  int port() const { return std::stoi(name_.substr(name_.rfind(':') + 1)); }

 private:
  RigFile rig_;
  VirtualRigOptions options_;
  std::atomic<bool> stopped_{false};
  std::string name_;
  std::thread thread_;
};

struct Case {
  const char* name;
  bool serial;
  InjectedFaults faults;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.name;
}

class LinkThreads : public testing::TestWithParam<Case> {};

TEST_P(LinkThreads, RunFromTheWaitToACompleteRunDirectory) {
  const Case& c = GetParam();
  const Folder folder;
  RigFile rig = read_rig_file(config + (c.serial ? "rigs/modbus-rtu.yaml" : "rigs/modbus-tcp.yaml"));
  // What is looked for is races, on a program that the sanitizer slows down.
  rig.modbus->response_timeout_s = 0.015;
  rig.calibration.zero_at_start = true;
  rig.calibration.zero_pose = ZeroPose::hanging;
  VirtualRigOptions options;
  (c.serial ? options.serial_line : options.tcp_host) =
      c.serial ? (folder / "line").string() : std::string("127.0.0.1");
  options.theta0_rad = 0.02;
  options.hang_s = 0.1;
  options.faults = c.faults;
  options.trace = folder / "trace.csv";
  const Server server(rig, options);
  if (c.serial)
    rig.modbus->device = options.serial_line;
  else
    rig.modbus->port = server.port();

  RunSetup setup;
  setup.label = "threads";
  setup.control = read_gain_file(config + "gains/exponential.yaml");
  setup.control.sample_rate_hz = 50;
  setup.rig = rig;
  MonotonicClock clock;
  const auto device = make_rig(rig, {setup.control.period_s()});
  device->open();
  find_zero(*device, clock, setup.rig, 2.0);
  SignalFlag signal{0};
  EXPECT_GT(wait_upright(*device, clock, setup.rig, signal, {10.0, {}}), 0.5);
  constexpr double duration_s = 1.5;
  setup.duration_s = duration_s;
  setup.limits = {static_cast<std::uint64_t>(duration_s * setup.control.sample_rate_hz), rig.track_limit_m,
                  rig.fall_angle_rad, rig.watchdog_s, default_periods_late(setup.control.period_s())};
  SessionOptions session;
  session.out = folder / "run";
  double shown_s = 0.0;
  session.show = [&shown_s](const LiveStatus& live) { shown_s = live.time_s.load(); };
  const SessionResult result = run_session(setup, *device, clock, signal, std::move(session));
  EXPECT_TRUE(result.outcome_written);
  EXPECT_GT(result.outcome.counts.periods, 0u);
  EXPECT_EQ(read_run(result.directory).samples.rows.size(), result.log.rows_written);
}

INSTANTIATE_TEST_SUITE_P(Links, LinkThreads,
                         testing::Values(Case{"tcp", false, {}}, Case{"rtu", true, {}},
                                         Case{"tcp_faults", false, {1, 10, 0.03, 15, 20, 0.0}},
                                         Case{"rtu_faults", true, {1, 10, 0.03, 15, 20, 0.0}},
                                         Case{"tcp_restart", false, {1, 0, 0.0, 0, 0, 0.5}},
                                         Case{"rtu_restart", true, {1, 0, 0.0, 0, 0, 0.5}}),
                         [](const auto& item) { return std::string(item.param.name); });

}  // namespace
}  // namespace upright::test
