// The control step with delay compensation, 300 voltages on their way. Reports the 99.9th percentile of
// single steps, since that is what a period must hold.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <vector>

#include "upright/control/controller.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {
namespace {

void control_step(benchmark::State& state, StateEstimatorKind kind, const char* plant_name = "viscous") {
  ControlConfig config;
  config.gains = {69.6, 141.4, 50.7, 26.8};
  config.delay_s = static_cast<double>(state.range(0)) * 1e-3;
  config.compensation.kind = CompensationKind::predictor;
  const Plant plant =
      read_plant_file(std::string(UPRIGHT_SOURCE_DIR) + "/config/plants/" + plant_name + ".yaml");
  config.state_estimator.kind = kind;
  Controller controller(config, 15.0, make_model_parts(config, plant, plant));
  std::vector<double> single_ns;
  single_ns.reserve(1u << 20);
  std::uint64_t tick = 0;
  for (auto _ : state) {
    const double phase = 0.01 * static_cast<double>(tick);
    const ControlInput input{++tick, 0.01 * std::sin(phase), 0.02 * std::cos(phase), 0.0};
    const auto before = std::chrono::steady_clock::now();
    benchmark::DoNotOptimize(controller.step(input));
    const auto after = std::chrono::steady_clock::now();
    if (single_ns.size() < single_ns.capacity())
      single_ns.push_back(std::chrono::duration<double, std::nano>(after - before).count());
  }
  const auto rank = static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(single_ns.size() - 1));
  std::nth_element(single_ns.begin(), single_ns.begin() + rank, single_ns.end());
  state.counters["p99.9_ns"] = single_ns[static_cast<std::size_t>(rank)];
}
BENCHMARK_CAPTURE(control_step, velocity_filter, StateEstimatorKind::none)->Arg(0)->Arg(100)->Arg(300);
BENCHMARK_CAPTURE(control_step, kalman, StateEstimatorKind::kalman)->Arg(0)->Arg(100)->Arg(300);
BENCHMARK_CAPTURE(control_step, extended_stick_slip, StateEstimatorKind::extended_kalman, "exponential")
    ->Arg(0)
    ->Arg(300);
BENCHMARK_CAPTURE(control_step, extended_bristles, StateEstimatorKind::extended_kalman, "dynamic")
    ->Arg(0)
    ->Arg(300);

}  // namespace
}  // namespace upright
