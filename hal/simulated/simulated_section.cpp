#include "simulated_section.hpp"

#include "../backends.hpp"
#include "../quoted.hpp"
#include "upright/base/error.hpp"

namespace upright {

SimulatedRig read_simulated(const YamlMap& map) {
  SimulatedRig rig;
  rig.plant = map.path("plant");
  const YamlMap initial = map.map("initial");
  rig.initial.cart_m = initial.number("cart_m", Range::within(-10, 10));
  rig.initial.theta_rad = initial.number("theta_rad", Range::within(-100, 100));
  rig.initial_cart_mps = initial.number_or("cart_velocity_mps", 0.0, Range::within(-100, 100));
  rig.initial_theta_radps = initial.number_or("pendulum_rate_radps", 0.0, Range::within(-1000, 1000));
  initial.finish();
  rig.quantise = map.flag_or("quantise", true);
  if (const auto noise = map.optional_map("noise")) {
    rig.cart_noise_m = noise->number_or("cart_m", 0.0, Range::within(0, 0.1));
    rig.theta_noise_rad = noise->number_or("theta_rad", 0.0, Range::within(0, 0.5));
    noise->finish();
  }
  rig.timing_jitter_s = map.number_or("timing_jitter_s", 0.0, Range::within(0, 0.01));
  map.finish();
  return rig;
}

std::string simulated_text(const SimulatedRig& rig) {
  return "simulated:\n  plant: " + quoted(rig.plant.string()) +
         "\n  initial: {cart_m: " + exact_text(rig.initial.cart_m) +
         ", theta_rad: " + exact_text(rig.initial.theta_rad) +
         ", cart_velocity_mps: " + exact_text(rig.initial_cart_mps) +
         ", pendulum_rate_radps: " + exact_text(rig.initial_theta_radps) +
         "}\n  quantise: " + (rig.quantise ? "true" : "false") +
         "\n  noise: {cart_m: " + exact_text(rig.cart_noise_m) +
         ", theta_rad: " + exact_text(rig.theta_noise_rad) +
         "}\n  timing_jitter_s: " + exact_text(rig.timing_jitter_s) + "\n";
}

BackendKind simulated_backend() {
  const auto make = [](const RigFile& rig, double) -> std::unique_ptr<Rig> {
    throw ConfigError(rig.file.string() + ":1: backend is simulated: name a hardware backend");
  };
  return {"simulated", nullptr, nullptr, make};
}

}  // namespace upright
