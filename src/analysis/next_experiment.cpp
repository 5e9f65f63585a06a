#include "upright/analysis/next_experiment.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "upright/sim/simulator.hpp"

namespace upright {

namespace {

struct SafeRun {
  std::string name;
  std::string description;
  std::function<double(double, double)> voltage;  ///< of time and largest voltage
  double duration_s = 8.0;
  bool amplifier_off = false;  ///< no voltage at all reaches the motor
  bool turned = false;  ///< the rig stands the other way round: what comes from the room changes its sign
  double theta_rad = std::numbers::pi;
};

std::vector<SafeRun> library() {
  const auto square = [](double period_s) {
    return [period_s](double t, double limit) {
      return std::fmod(t, period_s) < 0.5 * period_s ? limit : -limit;
    };
  };
  const auto multisine = [](double lowest_hz, double share) {
    return [lowest_hz, share](double t, double limit) {
      double sum = 0.0;
      for (int i = 0; i < 8; ++i)
        sum += std::sin(2.0 * std::numbers::pi * lowest_hz * std::pow(1.7, i) * t + 1.3 * i * i) / 4.0;
      return share * limit * sum;
    };
  };
  return {
      {"slow ramps to breakaway",
       "pendulum hanging; the voltage grows by 0.1 V/s in both directions until the cart moves, then stops",
       [](double t, double) { return (std::fmod(t, 16.0) < 8.0 ? 1.0 : -1.0) * 0.15 * std::fmod(t, 8.0); },
       16.0},
      {"creep and coast",
       "pendulum hanging; half a second of low voltage, then a coast at zero volts, at growing levels in "
       "both directions",
       [](double t, double limit) {
         return std::fmod(t, 1.5) < 0.6
                    ? (std::fmod(t, 3.0) < 1.5 ? 1.0 : -1.0) * limit * (0.15 + 0.05 * t / 2.0)
                    : 0.0;
       },
       12.0},
      {"square wave", "pendulum hanging; a square wave of 1.2 s about the middle of the track", square(1.2)},
      {"fast square wave", "pendulum hanging; a square wave of 0.3 s, logged at 1 kHz or faster",
       square(0.3)},
      {"rich multisine",
       "pendulum hanging; a multisine from 0.2 to 8 Hz at two thirds of the voltage that fits the track",
       multisine(0.2, 0.67), 12.0},
      {"quiet multisine", "pendulum hanging; the same multisine at a fifth of the voltage",
       multisine(0.2, 0.2), 12.0},
      {"pendulum decay", "cart held by hand or clamp; let the pendulum swing out from 90 degrees, motor off",
       [](double, double) { return 0.0; }, 20.0, true, false, 0.5 * std::numbers::pi},
      {"amplifier off",
       "amplifier switched off at its own switch, pendulum hanging; push the cart by hand and let it coast",
       [](double, double) { return 0.0; }, 4.0, true},
      {"rig turned by 180 degrees",
       "turn the whole rig by 180 degrees on its table and repeat a square wave of 1.2 s", square(1.2), 8.0,
       false, true},
  };
}

struct Samples {
  std::vector<double> cart_m, theta_rad;
  double travel_m = 0.0;
};

Samples simulate(const Plant& plant, const SafeRun& run, double limit_v) {
  Plant changed = plant;
  if (run.amplifier_off) changed.remove(effect_number("voltage_offset"));
  if (run.turned) {
    // Gravity on a tilted track turns round with the room; friction and amplifier do not.
    const std::size_t tilt = effect_number("constant_force");
    if (const PlantEffect* effect = plant.find(tilt))
      changed.set(tilt, std::vector<double>{-effect->values[0]});
  }
  const bool held = run.name == "pendulum decay";
  Simulator<double> simulator(make_model<double>(changed, held));
  PlantState<double> start;
  start.theta_rad = plant.pendulum ? run.theta_rad : 0.0;
  if (run.name == "amplifier off") start.cart_mps = 0.3;
  simulator.start(start);
  constexpr double period_s = 2e-3;
  Samples samples;
  for (int k = 0; k * period_s < run.duration_s; ++k) {
    const double t = k * period_s;
    const Outputs<double> y = simulator.engine().outputs();
    samples.cart_m.push_back(y.cart_m);
    samples.theta_rad.push_back(y.theta_rad);
    samples.travel_m = std::max(samples.travel_m, std::abs(y.cart_m));
    if (!run.amplifier_off) simulator.command(t, run.voltage(t, limit_v));
    simulator.advance_to(t + period_s);
  }
  return samples;
}

}  // namespace

std::optional<NextExperiment> choose_experiment(const Plant& chosen,
                                                const std::vector<std::pair<std::size_t, Plant>>& rivals,
                                                const std::vector<Measurement>& runs) {
  double cart_noise = 1e-5, theta_noise = 5e-4;
  for (const Measurement& run : runs) {
    if (run.has_cart()) cart_noise = run.cart_noise_m();
    if (run.has_theta()) theta_noise = run.theta_noise_rad();
  }
  std::optional<NextExperiment> best;
  for (const SafeRun& run : library()) {
    if (run.name == "pendulum decay" && !chosen.pendulum) continue;
    // Plan within the track: lower the voltage until the run stays within it.
    constexpr double safe_travel_m = 0.3;
    double limit_v = 6.0;
    Samples base = simulate(chosen, run, limit_v);
    while (base.travel_m > safe_travel_m && limit_v > 0.3) base = simulate(chosen, run, limit_v *= 0.7);
    if (base.travel_m > safe_travel_m) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [effect, plant] : rivals) {
      const Samples other = simulate(plant, run, limit_v);
      double sum = 0.0;
      for (std::size_t k = 0; k < base.cart_m.size(); ++k)
        sum += std::pow((base.cart_m[k] - other.cart_m[k]) / cart_noise, 2) +
               std::pow((base.theta_rad[k] - other.theta_rad[k]) / theta_noise, 2);
      least = std::min(least, std::sqrt(sum / static_cast<double>(base.cart_m.size())));
    }
    if (!best || least > best->distance) best = NextExperiment{run.name, run.description, least};
  }
  return best;
}

}  // namespace upright
