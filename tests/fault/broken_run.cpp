#include "broken_run.hpp"

#include <memory>
#include <utility>

#include "broken_compensator.hpp"
#include "upright/base/error.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/runtime/session.hpp"

namespace upright::test {

std::optional<BrokenRun> broken_run(const std::filesystem::path& rig_file,
                                    const std::filesystem::path& gain_file,
                                    const std::filesystem::path& runs) {
  constexpr int bad_cycle = 100;
  RunSetup setup;
  setup.command = "broken_run";
  setup.label = "nan";
  setup.duration_s = 1.5;
  setup.control = read_gain_file(gain_file);
  setup.rig = read_rig_file(rig_file);
  const double period_s = setup.control.period_s();
  setup.limits = {3 * bad_cycle, setup.rig.track_limit_m, setup.rig.fall_angle_rad, setup.rig.watchdog_s,
                  default_periods_late(period_s)};
  MonotonicClock clock;
  const SignalFlag signal{0};
  const std::unique_ptr<Rig> rig = make_rig(setup.rig, {period_s});
  try {
    rig->open();
  } catch (const DeviceError&) {
    return std::nullopt;
  }
  SessionOptions options;
  options.out = runs;
  std::atomic<double> began_s{0.0};
  options.parts = std::make_unique<BrokenCompensator>(bad_cycle, began_s);
  const SessionResult result = run_session(setup, *rig, clock, signal, std::move(options));
  if (began_s == 0.0) return std::nullopt;
  return BrokenRun{result.directory, began_s};
}

}  // namespace upright::test
