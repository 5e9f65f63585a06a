// Lanes on each kind of registers (baseline, AVX2, AVX-512), for each kind of loop, in one run; and what
// empty lanes cost. The lanes choose their registers once for a process, by UPRIGHT_LANES: so each
// measurement is a process of its own. All of them take turns, and the best of each counts.
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <stdexcept>

#include "sweep_bench.hpp"

namespace upright {

namespace {

constexpr const char* registers[] = {"avx512", "avx2", "baseline"};
constexpr std::size_t kinds = std::size(registers);
constexpr int turns = 3;

struct Measured {
  double ms = 0.0;
  std::size_t lanes = 0;
};

/// `measure` in a process whose lanes have registers no wider than `widest`.
Measured with_registers(const char* widest, const std::function<double()>& measure) {
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    ::setenv("UPRIGHT_LANES", widest, 1);
    const double ms = measure();
    const Measured made{ms, runs_side_by_side()};
    ::_exit(::write(ends[1], &made, sizeof made) == sizeof made ? 0 : 1);
  }
  ::close(ends[1]);
  Measured made;
  const bool whole = ::read(ends[0], &made, sizeof made) == sizeof made;
  ::close(ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  if (!whole || status != 0) throw std::runtime_error("a measurement failed");
  return made;
}

/// The best of some turns of all measurements on all registers.
std::vector<std::array<Measured, kinds>> in_turn(const std::vector<std::function<double()>>& measurements) {
  std::vector<std::array<Measured, kinds>> best(measurements.size());
  for (int turn = 0; turn < turns; ++turn)
    for (std::size_t i = 0; i < measurements.size(); ++i)
      for (std::size_t k = 0; k < kinds; ++k) {
        const Measured made = with_registers(registers[k], measurements[i]);
        if (turn == 0 || made.ms < best[i][k].ms) best[i][k] = made;
      }
  return best;
}

void each_loop() {
  LoopSetup continuous_smooth = setup_for("exponential", 100.0), continuous = setup_for("exponential", 0.0),
            continuous_bristles = setup_for("dynamic", 0.0);
  for (LoopSetup* setup : {&continuous_smooth, &continuous, &continuous_bristles}) setup->sampled = false;
  std::vector<LoopCase> late = cases_240();
  for (LoopCase& one : late) one.delay_s = 0.1;
  struct Row {
    const char* name;
    LoopSetup setup;
    std::vector<LoopCase> cases = cases_240();
  };
  const std::vector<Row> rows = {
      {"sampled, smooth friction", setup_for("exponential", 100.0)},
      {"sampled, stick-slip", setup_for("exponential", 0.0)},
      {"sampled, bristles", setup_for("dynamic", 0.0)},
      {"encoders, stick-slip", rig_loop("exponential")},
      {"encoders, bristles", rig_loop("dynamic")},
      {"encoders, stick-slip, Kalman filter", with_models(rig_loop("exponential"), true, false)},
      {"encoders, stick-slip, predictor", with_models(rig_loop("exponential"), false, true), late},
      {"encoders, stick-slip, both", with_models(rig_loop("exponential"), true, true), late},
      {"continuous, smooth friction", continuous_smooth},
      {"continuous, stick-slip", continuous},
      {"continuous, bristles", continuous_bristles},
  };
  std::vector<std::function<double()>> measurements;
  measurements.reserve(rows.size());
  for (const Row& row : rows) measurements.emplace_back([&row] { return lanes_ms(row.setup, row.cases); });
  const auto best = in_turn(measurements);
  std::printf("%-38s", "ms per run on lanes");
  for (std::size_t k = 0; k < kinds; ++k) std::printf("  %s (%zu)", registers[k], best[0][k].lanes);
  std::printf("\n");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double wide = best[i][0].ms;
    std::printf("  %-36s %8.3f   %8.3f (%.2f x) %8.3f (%.2f x)\n", rows[i].name, wide, best[i][1].ms,
                best[i][1].ms / wide, best[i][2].ms, best[i][2].ms / wide);
  }
}

/// Milliseconds per run where a call has at most `together` runs.
double in_calls_ms(const LoopSetup& setup, const std::vector<LoopCase>& cases, std::size_t together) {
  double sum_ms = 0.0;
  for (std::size_t first = 0; first < cases.size(); first += together) {
    const std::size_t count = std::min(together, cases.size() - first);
    const std::vector<LoopCase> some(cases.begin() + static_cast<std::ptrdiff_t>(first),
                                     cases.begin() + static_cast<std::ptrdiff_t>(first + count));
    sum_ms += lanes_ms(setup, some) * static_cast<double>(count);
  }
  return sum_ms / static_cast<double>(cases.size());
}

/// Six starts of each of 80 plants that differ by up to five percent.
double of_plants_ms(bool at_once) {
  const LoopSetup setup = rig_loop("exponential");
  std::vector<PlantModel<double>> plants;
  for (int i = 0; i < 80; ++i) {
    plants.push_back(setup.model);
    plants.back().base.cart_mass_kg *= 0.95 + 0.1 * i / 79.0;
  }
  const std::vector<LoopCase> cases = {{0.02, 0.01}, {0.05, 0.01}, {0.09, 0.01},
                                       {0.02, 0.02}, {0.05, 0.02}, {0.09, 0.02}};
  std::vector<LoopResult> results(plants.size() * cases.size());
  double best_s = 1e300;
  for (int repeat = 0; repeat < 3; ++repeat) {
    const double begin = cpu_s();
    if (at_once)
      run_plants_on_lanes(setup, plants, cases, results);
    else
      for (std::size_t i = 0; i < plants.size(); ++i)
        run_plants_on_lanes(setup, std::span(plants).subspan(i, 1), cases,
                            std::span(results).subspan(i * cases.size(), cases.size()));
    best_s = std::min(best_s, cpu_s() - begin);
  }
  return 1e3 * best_s / static_cast<double>(results.size());
}

/// Every other run falls within the first second.
void empty_lanes() {
  std::vector<LoopCase> cases = cases_240();
  for (std::size_t i = 0; i < cases.size(); i += 2) cases[i] = {0.2, 0.08};
  std::vector<std::function<double()>> measurements;
  const char* names[] = {"encoders, stick-slip, half of the runs fall",
                         "encoders, bristles, half of the runs fall"};
  const LoopSetup setups[] = {rig_loop("exponential"), rig_loop("dynamic")};
  for (const LoopSetup& setup : setups) {
    measurements.emplace_back([&] { return in_calls_ms(setup, cases, runs_side_by_side()); });
    measurements.emplace_back([&] { return in_calls_ms(setup, cases, cases.size()); });
  }
  measurements.emplace_back([] { return of_plants_ms(false); });
  measurements.emplace_back([] { return of_plants_ms(true); });
  const auto best = in_turn(measurements);
  std::printf(
      "ms per run: as many runs as lanes in a call, then all in one call, whose lanes are refilled\n");
  const auto row = [&](const char* name, std::size_t i) {
    std::printf("  %-46s", name);
    for (std::size_t k = 0; k < kinds; ++k)
      std::printf("  %s %.3f -> %.3f (%.2f x)", registers[k], best[i][k].ms, best[i + 1][k].ms,
                  best[i][k].ms / best[i + 1][k].ms);
    std::printf("\n");
  };
  row(names[0], 0);
  row(names[1], 2);
  row("encoders, stick-slip, 80 plants of 6 runs each", 4);
}

}  // namespace

void bench_registers() {
  each_loop();
  empty_lanes();
}

}  // namespace upright
