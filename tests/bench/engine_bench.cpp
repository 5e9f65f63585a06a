// Speed of the engines: whole 10 s closed-loop runs for each friction and loop form, and the worst single
// period of the real-time plant over a grid of starts and delays.
#include <benchmark/benchmark.h>

#include <ctime>

#include "../property/engine_runs.hpp"
#include "../unit/plants.hpp"
#include "sim/cvode_engine.hpp"

namespace upright {
namespace {

using namespace test;

constexpr const char* plants[] = {"viscous", "exponential", "dynamic"};

template <class Engine>
void ten_seconds(benchmark::State& state) {
  const Plant plant = config_plant(plants[state.range(0)]);
  const RunCase run{static_cast<LoopForm>(state.range(1)), state.range(1) == 0 ? 0.0 : 0.006, 0.05, 10.0};
  std::uint64_t steps = 0;
  for (auto _ : state) steps = record<Engine>(plant, run).steps;
  state.counters["steps"] = static_cast<double>(steps);
  state.SetLabel(std::string(plants[state.range(0)]) + (state.range(1) == 0   ? " open"
                                                        : state.range(1) == 1 ? " sampled"
                                                                              : " continuous"));
}
BENCHMARK(ten_seconds<EventEngine<double>>)
    ->ArgsProduct({{0, 1, 2}, {0, 1, 2}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(ten_seconds<CvodeEngine>)->ArgsProduct({{0, 1, 2}, {0, 1, 2}})->Unit(benchmark::kMillisecond);

/// Processor time of this thread, so that other programs do not count; reading it costs some 0.2 us itself.
double thread_time_us() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e6 + static_cast<double>(t.tv_nsec) * 1e-3;
}

/// Every period of 200 runs, timed one by one.
template <class Engine>
void worst_period(benchmark::State& state) {
  const Plant plant = config_plant(plants[state.range(0)]);
  const PlantModel<double> model = make_model<double>(plant);
  std::vector<double> times_us;
  for (auto _ : state) {
    times_us.clear();
    for (int i = 0; i < 20; ++i)
      for (int j = 0; j < 10; ++j) {
        EngineOptions options;
        options.fall_angle_rad = 1.0;
        SampledLoop<Engine> loop(model, 1000.0, options);
        LateFeedback law(0.12 * j / 9.0);
        loop.start({0.0, (i % 2 == 0 ? 1.0 : -1.0) * 1.7e-4 * std::pow(1000.0, (i / 2) / 9.0), 0.0, 0.0});
        for (int k = 0; k < state.range(1) && !loop.engine().halted(); ++k) {
          const double begin_us = thread_time_us();
          loop.step(law);
          times_us.push_back(thread_time_us() - begin_us);
        }
      }
  }
  std::sort(times_us.begin(), times_us.end());
  const auto quantile = [&](double q) {
    return times_us[static_cast<std::size_t>(q * static_cast<double>(times_us.size() - 1))];
  };
  state.counters["median_us"] = quantile(0.5);
  state.counters["p99.9_us"] = quantile(0.999);
  state.counters["worst_us"] = times_us.back();
  state.SetLabel(plants[state.range(0)]);
}
/// The 200 starts and delays over whole runs of 10 s: the most events and steps that any run made per second
/// (chatter shows in the first, a hang in the time).
template <class Engine>
void whole_grid(benchmark::State& state) {
  const Plant plant = config_plant(plants[state.range(0)]);
  double events_per_s = 0.0, steps_per_s = 0.0;
  for (auto _ : state)
    for (int i = 0; i < 20; ++i)
      for (int j = 0; j < 10; ++j) {
        const double start_rad = (i % 2 == 0 ? 1.0 : -1.0) * 1.7e-4 * std::pow(1000.0, (i / 2) / 9.0);
        const RecordedRun run =
            record<Engine>(plant, {static_cast<LoopForm>(state.range(1)), 0.12 * j / 9.0, start_rad, 10.0});
        const double ran_s = static_cast<double>(run.states.size()) * record_period_s;
        events_per_s = std::max(events_per_s, static_cast<double>(run.event_count) / ran_s);
        steps_per_s = std::max(steps_per_s, static_cast<double>(run.steps) / ran_s);
      }
  state.counters["events_per_s"] = events_per_s;
  state.counters["steps_per_s"] = steps_per_s;
  state.SetLabel(std::string(plants[state.range(0)]) + (state.range(1) == 1 ? " sampled" : " continuous"));
}
BENCHMARK(whole_grid<EventEngine<double>>)
    ->ArgsProduct({{0, 1, 2}, {1, 2}})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(whole_grid<CvodeEngine>)
    ->ArgsProduct({{0, 1, 2}, {1, 2}})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

BENCHMARK(worst_period<EventEngine<double>>)->ArgsProduct({{0, 1, 2}, {2000}})->Iterations(1);
BENCHMARK(worst_period<CvodeEngine>)->ArgsProduct({{0, 1, 2}, {100}})->Iterations(1);

}  // namespace
}  // namespace upright
