// Sessions on the simulated rig, for tests that put a rig of their own around it.
#pragma once

#include <numbers>
#include <string>
#include <utility>

#include "temporary_folder.hpp"
#include "upright/hal/simulated_rig.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/record/run_reader.hpp"
#include "upright/runtime/session.hpp"

namespace upright::test {

inline RigFile simulated_file(const std::string& plant = "exponential") {
  RigFile rig = read_rig_file(UPRIGHT_SOURCE_DIR "/config/rigs/simulated.yaml");
  rig.simulated->plant = UPRIGHT_SOURCE_DIR "/config/plants/" + plant + ".yaml";
  return rig;
}

inline RunSetup setup_for(const RigFile& rig, double duration_s, double theta0_deg = 3.0) {
  RunSetup setup;
  setup.label = "test";
  setup.command = "runtime_test";
  setup.duration_s = duration_s;
  setup.fast = true;
  setup.seed = 1;
  setup.theta0_rad = theta0_deg * std::numbers::pi / 180.0;
  setup.control = read_gain_file(UPRIGHT_SOURCE_DIR "/config/gains/exponential.yaml");
  setup.rig = rig;
  setup.limits = rig_limits(rig, read_plant_file(rig.simulated->plant));
  setup.limits.coast_s = 0.0;
  setup.limits.periods = static_cast<std::uint64_t>(duration_s * setup.control.sample_rate_hz);
  setup.limits.max_periods_late = default_periods_late(setup.control.period_s());
  return setup;
}

struct TestRun {
  SessionResult result;
  RunRecord record;
  double last_v = 0.0;
  bool stopped = false;
};

/// Opens `rig` and runs the session on it. The rig remembers the voltage written last, and whether it was
/// stopped.
template <class WrappedRig>
TestRun run_on(WrappedRig& rig, Clock& clock, const TemporaryFolder& folder, const RunSetup& setup,
               int signal_number = 0) {
  rig.open();
  const SignalFlag signal{signal_number};
  SessionOptions options;
  options.out = folder.path();
  SessionResult result = run_session(setup, rig, clock, signal, std::move(options));
  RunRecord record = read_run(result.directory);
  return {result, record, rig.last_v, rig.stopped};
}

}  // namespace upright::test
