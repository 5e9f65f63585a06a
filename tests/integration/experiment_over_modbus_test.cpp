// `upright experiment` over the real links against the virtual rig: refused without a sign check, which is
// done once, notices a wrong sign, and opens the way to the others.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "virtual_rig_process.hpp"

namespace upright::test {
namespace {

const std::string config = UPRIGHT_SOURCE_DIR "/config/";

struct Said {
  int exit_code = -1;
  std::string out;
};

struct Link {
  std::string name;
  bool serial = false;
  std::string rate_hz;
};

class ExperimentOverModbus : public ::testing::TestWithParam<Link> {
 protected:
  ExperimentOverModbus()
      : rig_text_(text_of(config + "rigs/modbus-" + GetParam().name + ".yaml")),
        server_(folder_, rig_text_, GetParam().serial, {"--theta0-deg", "180"}) {
    rig_text_ = GetParam().serial
                    ? replaced(rig_text_, "/dev/ttyUSB0", server_.name())
                    : replaced(rig_text_, "port: 1502", "port: " + std::to_string(server_.port()));
    std::ofstream(folder_ / "rig.yaml") << rig_text_;
  }

  Said experiment(const std::string& file, const std::string& rig, const std::string& out) {
    Process client({"sh", "-c", "exec \"$0\" \"$@\" 2>&1", UPRIGHT_BINARY, "experiment", file, "--rig",
                    folder_ / rig, "--rate", GetParam().rate_hz, "--out", folder_ / out});
    Said said;
    said.out = client.rest();
    said.exit_code = client.wait();
    return said;
  }
  /// Exit code of `upright run` with the pendulum hanging: 2 refused, 3 looked and stopped at once.
  int run() {
    std::ofstream(folder_ / "gains.yaml")
        << replaced(text_of(config + "gains/exponential.yaml"), "sample_rate_hz: 1000",
                    "sample_rate_hz: " + GetParam().rate_hz);
    Process client({UPRIGHT_BINARY, "run", "--rig", folder_ / "rig.yaml", "--gains", folder_ / "gains.yaml",
                    "--wait", "0", "--out", folder_ / "runs"});
    client.rest();
    return client.wait();
  }
  std::string ramp() {
    const std::string file = folder_ / "ramp.yaml";
    std::ofstream(file) << "experiment:\n  name: ramp\n  why: a test\n  plant: " << config
                        << "plants/exponential.yaml\n  travel_m: 0.3\n  voltage_limit_v: 10\n"
                        << "  pieces:\n    - {kind: ramp, rate_v_per_s: 0.4}\n";
    return file;
  }

  Folder folder_;
  std::string rig_text_;
  VirtualRigProcess server_;
};

TEST_P(ExperimentOverModbus, AsksForASignCheckOnceAndThenRuns) {
  EXPECT_EQ(experiment(ramp(), "rig.yaml", "out").exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  EXPECT_EQ(run(), 2);
  const Said check = experiment(config + "experiments/sign-check.yaml", "rig.yaml", "signs");
  EXPECT_EQ(check.exit_code, 0) << check.out;
  EXPECT_NE(check.out.find("signs agree"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "rig.yaml.signs"));
  EXPECT_EQ(run(), 3);
  const Said ramps = experiment(ramp(), "rig.yaml", "out");
  EXPECT_EQ(ramps.exit_code, 0) << ramps.out;
  double farthest = 0.0;
  for (const TraceRow& row : server_.trace()) farthest = std::max(farthest, std::abs(row.cart_m));
  EXPECT_LT(farthest, 0.3);
  // A sign that was turned after the check is a rig that nobody checked.
  std::ofstream(folder_ / "rig.yaml") << replaced(rig_text_, "sign: 1", "sign: -1");
  EXPECT_EQ(experiment(ramp(), "rig.yaml", "out2").exit_code, 2);
  EXPECT_EQ(run(), 2);
}

TEST_P(ExperimentOverModbus, ASignCheckNoticesAWrongSign) {
  std::ofstream(folder_ / "wrong.yaml")
      << replaced(rig_text_, "pendulum: {counts_per_revolution: 4096, sign: 1",
                  "pendulum: {counts_per_revolution: 4096, sign: -1");
  const Said check = experiment(config + "experiments/sign-check.yaml", "wrong.yaml", "signs");
  EXPECT_EQ(check.exit_code, 3) << check.out;
  EXPECT_NE(check.out.find("turn calibration.pendulum.sign"), std::string::npos) << check.out;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "wrong.yaml.signs"));
}

INSTANTIATE_TEST_SUITE_P(Links, ExperimentOverModbus,
                         testing::Values(Link{"tcp", false, "500"}, Link{"rtu", true, "200"}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace upright::test
