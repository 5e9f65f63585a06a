#include "simulated_section.hpp"

#include "../backends.hpp"
#include "upright/base/error.hpp"

namespace upright {

void simulated_keys(YamlKeys& keys, SimulatedRig& rig) {
  keys.path("plant", rig.plant);
  keys.map("initial", [&](YamlKeys& initial) {
    initial.number("cart_m", rig.initial.cart_m, Range::within(-10, 10));
    initial.number("theta_rad", rig.initial.theta_rad, Range::within(-100, 100));
    initial.number("cart_velocity_mps", rig.initial_cart_mps, Range::within(-100, 100), 0.0);
    initial.number("pendulum_rate_radps", rig.initial_theta_radps, Range::within(-1000, 1000), 0.0);
  });
  keys.flag("quantise", rig.quantise, true, Usual::written);
  keys.usual_map("noise", [&](YamlKeys& noise) {
    noise.number("cart_m", rig.cart_noise_m, Range::within(0, 0.1), 0.0);
    noise.number("theta_rad", rig.theta_noise_rad, Range::within(0, 0.5), 0.0);
  });
  keys.number("timing_jitter_s", rig.timing_jitter_s, Range::within(0, 0.01), 0.0);
}

BackendKind simulated_backend() {
  const auto make = [](const RigFile& rig, double) -> std::unique_ptr<Rig> {
    throw ConfigError(rig.file.string() + ":1: backend is simulated: use a hardware backend");
  };
  return {"simulated", nullptr, make};
}

}  // namespace upright
