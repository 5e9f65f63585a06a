// A controller of one's own in the control loop of upright: it swings the pendulum up by its energy (Astrom
// and Furuta, Automatica 36, 2000) and leaves the balancing to the state feedback of a gain file.
//   swing_up RIG GAINS [--real-time]
#include <algorithm>
#include <cmath>
#include <cstring>
#include <iostream>
#include <numbers>

#include "upright/base/error.hpp"
#include "upright/control/command_source.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/hal/simulated_rig.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/runtime/session.hpp"

namespace {

/// Called by the loop once per period: it must not allocate, lock or throw.
class SwingUp final : public upright::CommandSource {
 public:
  explicit SwingUp(const upright::Plant& plant)
      : pendulum_(plant.pendulum.value()), motor_(plant.motor), gravity_mps2_(plant.gravity_mps2) {
    total_mass_kg_ = plant.cart_mass_kg + pendulum_.mass_kg;
    const upright::PlantEffect* viscous = plant.find("viscous_friction");
    braking_n_per_mps_ = motor_.back_emf_n_per_mps + (viscous == nullptr ? 0.0 : viscous->values[0]);
  }

  upright::Demand next(std::uint64_t /*tick*/, const upright::ControlState& now) noexcept override {
    constexpr double turn_rad = 2.0 * std::numbers::pi;
    const double upright_rad = turn_rad * std::nearbyint(now.theta_rad / turn_rad);
    caught_ =
        caught_ || (std::abs(now.theta_rad - upright_rad) < catch_rad && std::abs(energy_j(now)) < catch_j);
    upright::Demand demand;
    demand.feedback = caught_;
    demand.reference_rad = upright_rad;
    if (!caught_) demand.voltage_v = voltage_for(acceleration(now), now);
    return demand;
  }

 private:
  /// Zero when the pendulum stands upright at rest.
  double energy_j(const upright::ControlState& now) const noexcept {
    const double weight_nm = pendulum_.mass_kg * gravity_mps2_ * pendulum_.length_to_com_m;
    return 0.5 * pendulum_.inertia_about_pivot_kgm2() * now.pendulum_rate_radps * now.pendulum_rate_radps +
           weight_nm * (std::cos(now.theta_rad) - 1.0);
  }

  /// Toward more energy, and back to the middle of the track.
  double acceleration(const upright::ControlState& now) const noexcept {
    const double swing = now.pendulum_rate_radps * std::cos(now.theta_rad);
    const double pump = std::clamp(gain_per_js * energy_j(now) * swing, -largest_mps2, largest_mps2);
    const double first_push_mps2 = std::abs(now.pendulum_rate_radps) < 0.05 ? 0.5 * largest_mps2 : 0.0;
    return pump + first_push_mps2 - middle_per_s2 * now.cart_m - middle_per_s * now.cart_velocity_mps;
  }

  /// The voltage that gives the cart this acceleration: the force for cart and pendulum, and for what brakes
  /// them.
  double voltage_for(double cart_mps2, const upright::ControlState& now) const noexcept {
    const double sine = std::sin(now.theta_rad), cosine = std::cos(now.theta_rad),
                 rate_radps = now.pendulum_rate_radps;
    const double first_moment_kgm = pendulum_.mass_kg * pendulum_.length_to_com_m;
    const double pendulum_radps2 =
        first_moment_kgm * (gravity_mps2_ * sine - cart_mps2 * cosine) / pendulum_.inertia_about_pivot_kgm2();
    const double force_n = total_mass_kg_ * cart_mps2 +
                           first_moment_kgm * (pendulum_radps2 * cosine - rate_radps * rate_radps * sine);
    return (force_n + braking_n_per_mps_ * now.cart_velocity_mps) / motor_.force_per_volt_n;
  }

  static constexpr double catch_rad = 0.25, catch_j = 0.15;  // where the state feedback can take over
  static constexpr double largest_mps2 = 3.0;
  static constexpr double gain_per_js = 20.0;
  static constexpr double middle_per_s2 = 8.0, middle_per_s = 1.0;

  upright::Pendulum pendulum_;
  upright::Motor motor_;
  double gravity_mps2_, total_mass_kg_, braking_n_per_mps_;
  bool caught_ = false;
};

int swing_up(const std::string& rig_file, const std::string& gain_file, bool real_time) {
  upright::RunSetup setup;
  setup.label = "swing-up";
  setup.duration_s = 20.0;
  setup.fast = !real_time;
  setup.control = upright::read_gain_file(gain_file);
  setup.rig = upright::read_rig_file(rig_file);
  setup.plant = upright::read_plant_file(setup.rig.simulated.value().plant);
  setup.theta0_rad = std::numbers::pi;  // hanging
  setup.limits = upright::rig_limits(setup.rig, setup.plant);
  setup.limits.periods = static_cast<std::uint64_t>(setup.duration_s * setup.control.sample_rate_hz);
  setup.limits.max_periods_late = upright::default_periods_late(setup.control.period_s());

  upright::VirtualClock virtual_clock;
  upright::MonotonicClock real_clock;
  upright::Clock& clock = real_time ? static_cast<upright::Clock&>(real_clock) : virtual_clock;
  const auto rig =
      upright::assembled(upright::make_simulated_rig(setup.rig, clock, {1, setup.theta0_rad}), setup.rig);
  rig->open();
  SwingUp swing_up(*setup.plant);
  upright::SessionOptions options;
  options.parts = upright::make_model_parts(setup.control);
  options.source = &swing_up;
  const upright::SignalFlag no_signal{0};
  const upright::LoopLimits limits = setup.limits;
  const upright::SessionResult result =
      upright::run_session(std::move(setup), *rig, clock, no_signal, std::move(options));
  std::cout << upright::sentence_of(result.outcome, limits, result.log) << "\n"
            << result.directory.string() << "\n";
  return result.outcome.reason == upright::StopReason::duration &&
                 std::abs(std::remainder(result.outcome.last_theta_rad, 2.0 * std::numbers::pi)) < 0.1
             ? 0
             : 3;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: swing_up RIG GAINS [--real-time]\n";
    return 2;
  }
  try {
    return swing_up(argv[1], argv[2], argc > 3 && std::strcmp(argv[3], "--real-time") == 0);
  } catch (const upright::Error& error) {
    std::cerr << "swing_up: " << error.what() << "\n";
    return static_cast<int>(error.code());
  }
}
