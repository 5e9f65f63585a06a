// `upright experiment` over the real links against the virtual rig: refused without a sign check, which is
// done once, notices a wrong sign, and opens the way to the others.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/run_end.hpp"
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

/// A rig whose pendulum hangs, and programs that drive it.
class Bench {
 public:
  explicit Bench(const Link& on)
      : link(on),
        rig_text(text_of(config + "rigs/modbus-" + link.name + ".yaml")),
        server(folder, rig_text, link.serial, {"--theta0-deg", "180"}) {
    rig_text = link.serial ? replaced(rig_text, "/dev/ttyUSB0", server.name())
                           : replaced(rig_text, "port: 1502", "port: " + std::to_string(server.port()));
    std::ofstream(folder / "rig.yaml") << rig_text;
  }

  Said experiment(const std::string& file, const std::string& rig, const std::string& out) {
    Process client({"sh", "-c", "exec \"$0\" \"$@\" 2>&1", UPRIGHT_BINARY, "experiment", file, "--rig",
                    folder / rig, "--rate", link.rate_hz, "--out", folder / out});
    Said said;
    said.out = client.rest();
    said.exit_code = client.wait();
    expect_no_late_end(folder / out);
    return said;
  }
  /// Exit code of `upright run` with the pendulum hanging: 2 refused, 3 looked and stopped at once.
  int run() {
    std::ofstream(folder / "gains.yaml")
        << replaced(text_of(config + "gains/exponential.yaml"), "sample_rate_hz: 1000",
                    "sample_rate_hz: " + link.rate_hz);
    Process client({UPRIGHT_BINARY, "run", "--rig", folder / "rig.yaml", "--gains", folder / "gains.yaml",
                    "--wait", "0", "--out", folder / "runs"});
    client.rest();
    return client.wait();
  }
  std::string ramp() {
    const std::string file = folder / "ramp.yaml";
    std::ofstream(file) << "experiment:\n  name: ramp\n  why: a test\n  plant: " << config
                        << "plants/exponential.yaml\n  travel_m: 0.3\n  voltage_limit_v: 10\n"
                        << "  pieces:\n    - {kind: ramp, rate_v_per_s: 0.4}\n";
    return file;
  }

  Link link;
  Folder folder;
  std::string rig_text;
  VirtualRigProcess server;
};

void check_signs_and_run(const Link& link) {
  Bench bench(link);
  EXPECT_EQ(bench.experiment(bench.ramp(), "rig.yaml", "out").exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(bench.folder / "out"));
  EXPECT_EQ(bench.run(), 2);
  const Said check = bench.experiment(config + "experiments/sign-check.yaml", "rig.yaml", "signs");
  EXPECT_EQ(check.exit_code, 0) << check.out;
  EXPECT_NE(check.out.find("signs agree"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(bench.folder / "rig.yaml.signs"));
  EXPECT_EQ(bench.run(), 3);
  const Said ramps = bench.experiment(bench.ramp(), "rig.yaml", "out");
  EXPECT_EQ(ramps.exit_code, 0) << ramps.out;
  double farthest = 0.0;
  for (const TraceRow& row : bench.server.trace()) farthest = std::max(farthest, std::abs(row.cart_m));
  EXPECT_LT(farthest, 0.3);
  // A sign that was turned after the check is a rig that nobody checked.
  std::ofstream(bench.folder / "rig.yaml") << replaced(bench.rig_text, "sign: 1", "sign: -1");
  EXPECT_EQ(bench.experiment(bench.ramp(), "rig.yaml", "out2").exit_code, 2);
  EXPECT_EQ(bench.run(), 2);
}

void check_wrong_sign(const Link& link) {
  Bench bench(link);
  std::ofstream(bench.folder / "wrong.yaml")
      << replaced(bench.rig_text, "pendulum: {counts_per_revolution: 4096, sign: 1",
                  "pendulum: {counts_per_revolution: 4096, sign: -1");
  const Said check = bench.experiment(config + "experiments/sign-check.yaml", "wrong.yaml", "signs");
  EXPECT_EQ(check.exit_code, 3) << check.out;
  EXPECT_NE(check.out.find("reverse calibration.pendulum.sign"), std::string::npos) << check.out;
  EXPECT_FALSE(std::filesystem::exists(bench.folder / "wrong.yaml.signs"));
}

class ExperimentOverModbus : public ::testing::TestWithParam<Link> {};

TEST_P(ExperimentOverModbus, AsksForASignCheckOnceAndThenRuns) {
  in_real_time([] { check_signs_and_run(GetParam()); });
}

TEST_P(ExperimentOverModbus, ASignCheckNoticesAWrongSign) {
  in_real_time([] { check_wrong_sign(GetParam()); });
}

INSTANTIATE_TEST_SUITE_P(Links, ExperimentOverModbus,
                         testing::Values(Link{"tcp", false, "500"}, Link{"rtu", true, "200"}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace upright::test
