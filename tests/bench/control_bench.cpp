// Speed of the control step and of a whole simulated run. Run by hand:
// build/release/tests/bench/control_bench
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <vector>

#include "upright/control/controller.hpp"
#include "upright/hal/simulated_rig.hpp"
#include "upright/runtime/session.hpp"

namespace upright {
namespace {

ControlConfig gains_with_delay(double delay_s) {
  ControlConfig config = read_gain_file(UPRIGHT_SOURCE_DIR "/config/gains/exponential.yaml");
  config.delay_s = delay_s;
  return config;
}

/// Every step on its own, clock and all, for its tail.
void control_step(benchmark::State& state) {
  Controller controller(gains_with_delay(static_cast<double>(state.range(0)) * 1e-6), 15.0);
  std::vector<double> took_ns;
  took_ns.reserve(10'000'000);
  std::uint64_t tick = 0;
  for (auto step : state) {
    const double t = static_cast<double>(tick) * 1e-3;
    const double cart_m = 0.05 * std::sin(t), theta_rad = 0.02 * std::cos(3.0 * t);
    const auto before = std::chrono::steady_clock::now();
    benchmark::DoNotOptimize(controller.step({tick++, cart_m, theta_rad, 0.0}));
    const auto after = std::chrono::steady_clock::now();
    took_ns.push_back(std::chrono::duration<double, std::nano>(after - before).count());
  }
  const auto quantile = [&](double part) {
    const auto place = static_cast<std::ptrdiff_t>(part * static_cast<double>(took_ns.size() - 1));
    std::nth_element(took_ns.begin(), took_ns.begin() + place, took_ns.end());
    return took_ns[static_cast<std::size_t>(place)];
  };
  state.counters["p50_ns"] = quantile(0.5);
  state.counters["p99.9_ns"] = quantile(0.999);
  state.counters["max_ns"] = quantile(1.0);
}
BENCHMARK(control_step)->Arg(0)->Arg(15000)->Arg(15500)->Iterations(1'000'000);

/// A whole run of `--fast`, files and all.
void fast_run(benchmark::State& state, const char* plant) {
  constexpr double duration_s = 60.0;
  const auto folder = std::filesystem::temp_directory_path() / "upright-bench";
  RunSetup setup;
  setup.label = "bench";
  setup.fast = true;
  setup.control = gains_with_delay(0.0);
  setup.rig = read_rig_file(UPRIGHT_SOURCE_DIR "/config/rigs/simulated.yaml");
  setup.rig.simulated->plant = std::string(UPRIGHT_SOURCE_DIR "/config/plants/") + plant + ".yaml";
  setup.limits = {static_cast<std::uint64_t>(duration_s * setup.control.sample_rate_hz),
                  setup.rig.track_limit_m, setup.rig.fall_angle_rad, setup.rig.watchdog_s, 50};
  for (auto run : state) {
    VirtualClock clock;
    const auto rig = make_simulated_rig(setup.rig, clock, {1, 3.0 * std::numbers::pi / 180.0});
    rig->open();
    const SignalFlag signal{0};
    SessionOptions options;
    options.out = folder;
    const SessionResult result = run_session(setup, *rig, clock, signal, std::move(options));
    if (result.outcome.reason != StopReason::duration) state.SkipWithError("the pendulum did not stay up");
  }
  std::filesystem::remove_all(folder);
  state.counters["times_real_time"] =
      benchmark::Counter(duration_s * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(fast_run, viscous, "viscous")->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(fast_run, exponential, "exponential")->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(fast_run, dynamic, "dynamic")->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace upright
