#include "upright/hal/simulated_rig.hpp"

#include <cmath>
#include <optional>
#include <random>
#include <utility>

#include "upright/base/error.hpp"
#include "upright/model/elementary.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {

namespace {

PlantState<double> initial_state(const SimulatedRig& rig, const std::optional<double>& theta0_rad) {
  PlantState<double> state;
  state.cart_m = rig.initial.cart_m;
  state.theta_rad = theta0_rad.value_or(rig.initial.theta_rad);
  state.cart_mps = rig.initial_cart_mps;
  state.theta_radps = rig.initial_theta_radps;
  return state;
}

/// Numbers of the standard normal distribution, by Marsaglia's polar method. That of the standard library
/// takes libm's logarithm, so that a seed would give other noise on another machine.
class NormalNoise {
 public:
  double operator()(std::mt19937_64& random) {
    if (spare_) return *std::exchange(spare_, std::nullopt);
    double x = 0.0, y = 0.0, square = 0.0;
    do {
      x = 2.0 * share(random) - 1.0;
      y = 2.0 * share(random) - 1.0;
      square = x * x + y * y;
    } while (square > 1.0 || square == 0.0);
    const double scale = std::sqrt(-2.0 * elementary::log(square) / square);
    spare_ = x * scale;
    return y * scale;
  }

 private:
  /// Even over 0 to 1.
  static double share(std::mt19937_64& random) { return 0x1p-64 * static_cast<double>(random()); }

  std::optional<double> spare_;
};

class SimulatedPlantRig final : public SimulatedRigWithHand {
 public:
  SimulatedPlantRig(const RigFile& rig, const Plant& plant, Clock& clock, const SimulatedRigOptions& options)
      : calibration_(calibration_in_use(rig)),
        config_(*rig.simulated),
        limit_v_(rig.amplifier.limit_v),
        clock_(clock),
        seed_(options.seed),
        initial_(initial_state(config_, options.theta0_rad)),
        plant_(plant),
        simulator_(std::make_unique<Simulator<double>>(make_model<double>(plant))) {}

  void open() override {
    random_.seed(seed_);
    normal_ = {};
    sequence_ = 0;
    hand_ = {};
    held_ = true;
    simulator_->start(initial_);
  }

  void handle(const Hand& hand) override {
    hand_ = hand;
    held_ = true;
    touched_ = false;
    simulator_ =
        std::make_unique<Simulator<double>>(make_model<double>(handled(plant_, hand), hand.cart_held));
    PlantState<double> state;
    state.cart_m = hand.pose.cart_m;
    state.theta_rad = hand.pose.theta_rad;
    state.cart_mps = hand.push_mps;
    simulator_->start(state);
  }

  RigReading read() noexcept override {
    std::int64_t now = clock_.now_ns();
    if (config_.timing_jitter_s > 0.0) {
      const double late_s = std::abs(normal_(random_)) * config_.timing_jitter_s;
      clock_.sleep_until(now + static_cast<std::int64_t>(late_s * 1e9));
      now = clock_.now_ns();
    }
    advance_to(now);
    const Outputs<double> seen = simulator_->engine().outputs();
    Pose pose{seen.cart_m, seen.theta_rad};
    if (config_.cart_noise_m > 0.0) pose.cart_m += config_.cart_noise_m * normal_(random_);
    if (config_.theta_noise_rad > 0.0) pose.theta_rad += config_.theta_noise_rad * normal_(random_);
    const EncoderCounts counts = counts_at(pose, calibration_);
    RigReading reading;
    reading.cart_counts = counts.cart;
    reading.pendulum_counts = counts.pendulum;
    reading.time_ns = now;
    reading.sequence = ++sequence_;
    reading.status = RigStatus::fresh;
    return reading;
  }

  RigFault write(double voltage_v) noexcept override {
    const std::int64_t now = clock_.now_ns();
    const double voltage = hand_.amplifier_off ? 0.0 : safe_voltage(voltage_v, limit_v_);
    if (held_ && hand_.holds_s > 0.0 && voltage == 0.0) {
      if (!touched_) hold_until_ns_ = now + static_cast<std::int64_t>(hand_.holds_s * 1e9);
      touched_ = true;
      if (now < hold_until_ns_) return std::isfinite(voltage_v) ? RigFault::none : RigFault::not_finite;
    }
    if (held_) {
      held_ = false;
      start_ns_ = now;
    }
    advance_to(now);
    simulator_->command(seconds_at(now), voltage);
    return std::isfinite(voltage_v) ? RigFault::none : RigFault::not_finite;
  }

  StopReport stop() noexcept override {
    if (!held_) write(0.0);
    return at_zero_volts();
  }

  std::uint64_t steps_taken() const noexcept override {
    constexpr std::uint64_t steps_per_event = 20;
    return simulator_->engine().step_count() + steps_per_event * simulator_->engine().event_count();
  }

 private:
  double seconds_at(std::int64_t now_ns) const noexcept {
    return static_cast<double>(now_ns - start_ns_) / 1e9;
  }
  void advance_to(std::int64_t now_ns) noexcept {
    if (!held_) simulator_->advance_to(seconds_at(now_ns));
  }

  Calibration calibration_;
  SimulatedRig config_;
  double limit_v_;
  Clock& clock_;
  std::uint64_t seed_;
  PlantState<double> initial_;
  Plant plant_;
  std::unique_ptr<Simulator<double>> simulator_;
  Hand hand_;
  std::mt19937_64 random_;
  NormalNoise normal_;
  std::uint64_t sequence_ = 0;
  std::int64_t start_ns_ = 0, hold_until_ns_ = 0;
  bool held_ = true, touched_ = false;
};

}  // namespace

Plant handled(Plant plant, const Hand& hand) {
  if (hand.amplifier_off) plant.remove(effect_number("voltage_offset"));
  if (hand.turned) {
    // Gravity on a tilted track turns round with the room; friction and amplifier do not.
    const std::size_t tilt = effect_number("constant_force");
    if (const PlantEffect* effect = plant.find(tilt))
      plant.set(tilt, std::vector<double>{-effect->values[0]});
  }
  return plant;
}

std::unique_ptr<SimulatedRigWithHand> make_simulated_rig(const RigFile& rig, const Plant& plant, Clock& clock,
                                                         const SimulatedRigOptions& options) {
  if (!rig.simulated) throw ConfigError(rig.file.string() + ":1: the section simulated is missing: add it");
  return std::make_unique<SimulatedPlantRig>(rig, plant, clock, options);
}

std::unique_ptr<SimulatedRigWithHand> make_simulated_rig(const RigFile& rig, Clock& clock,
                                                         const SimulatedRigOptions& options) {
  if (!rig.simulated) throw ConfigError(rig.file.string() + ":1: the section simulated is missing: add it");
  return make_simulated_rig(rig, read_plant_file(rig.simulated->plant), clock, options);
}

}  // namespace upright
