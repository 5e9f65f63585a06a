// The watch on the encoders over random rigs: none whose encoders count is stopped, however its friction, lag
// and delay make the cart rest; an encoder that sticks is found in the time of docs/reference/faults.md.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "design/delay_margin.hpp"
#include "design/gain_design.hpp"
#include "model/linear_plant.hpp"
#include "record/run_log.hpp"
#include "runtime/control_loop.hpp"
#include "upright/base/error.hpp"
#include "upright/control/controller.hpp"
#include "upright/hal/simulated_rig.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/runtime/session.hpp"

namespace upright {
namespace {

const std::filesystem::path config = std::filesystem::path(UPRIGHT_SOURCE_DIR) / "config";
constexpr double smoothing = 100.0;

enum class Sticks { nothing, cart, pendulum };

/// A rig whose encoder stops counting in a given cycle.
class StickingRig final : public Rig {
 public:
  StickingRig(Rig& rig, Sticks what, std::uint64_t from_cycle)
      : rig_(rig), what_(what), from_cycle_(from_cycle) {}
  void open() override { rig_.open(); }
  RigReading read() noexcept override {
    RigReading reading = rig_.read();
    if (cycle_ == from_cycle_) held_ = reading;
    if (cycle_++ >= from_cycle_) {
      if (what_ == Sticks::cart) reading.cart_counts = held_.cart_counts;
      if (what_ == Sticks::pendulum) reading.pendulum_counts = held_.pendulum_counts;
    }
    return reading;
  }
  RigFault write(double voltage_v) noexcept override { return rig_.write(voltage_v); }
  StopReport stop() noexcept override { return rig_.stop(); }

 private:
  Rig& rig_;
  Sticks what_;
  std::uint64_t from_cycle_, cycle_ = 0;
  RigReading held_;
};

struct BalancedRig {
  Plant plant;
  ControlConfig control;
  double theta0_rad = 0.05;
};

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  bool one_in(int n) { return std::uniform_int_distribution(1, n)(random_) == 1; }
  template <class T, std::size_t N>
  T any_of(const T (&values)[N]) {
    return values[std::uniform_int_distribution<std::size_t>(0, N - 1)(random_)];
  }

 private:
  std::mt19937_64 random_;
};

Plant random_plant(Draw& draw) {
  Plant plant =
      read_plant_file(config / "plants" / draw.any_of({"exponential.yaml", "dynamic.yaml", "viscous.yaml"}));
  plant.cart_mass_kg *= draw.uniform(0.7, 1.5);
  plant.pendulum->length_to_com_m *= draw.uniform(0.5, 1.6);
  plant.pendulum->mass_kg *= draw.uniform(0.6, 1.5);
  const double sliding_n = draw.uniform(0.0, 2.0);
  if (!draw.one_in(3)) {
    plant.set("coulomb_friction", {sliding_n});
    if (plant.find("stribeck_friction"))
      plant.set("stribeck_friction",
                {draw.uniform(0.0, 1.0) * (2.0 - sliding_n), draw.uniform(0.03, 0.2), 2.0});
  }
  if (draw.one_in(2)) plant.set("input_delay", {draw.uniform(0.0, 0.02)});
  if (draw.one_in(2)) plant.set("motor_lag", {draw.uniform(0.0, 0.02)});
  return plant;
}

/// Gains that hold the sliding plant at its actuator's delay and lag: those of the paper or designed ones.
bool stabilized(Draw& draw, BalancedRig& rig) {
  const Plant sliding = sliding_plant(rig.plant);
  try {
    if (!draw.one_in(3)) {
      DesignWeights weights;
      for (double& q : weights.q) q *= std::exp(draw.uniform(-1.5, 1.5));
      weights.r *= std::exp(draw.uniform(-1.5, 1.5));
      const auto k = design_gains(draw.one_in(2) ? rig.plant : sliding, weights, smoothing).gains;
      rig.control.gains = {k[0], k[1], k[2], k[3]};
    }
    return sampled_margin(sliding, rig.control, smoothing, false).stable_without_delay;
  } catch (const ConfigError&) {
    return false;
  }
}

BalancedRig random_rig(std::uint64_t seed) {
  Draw draw(seed);
  BalancedRig rig;
  do {
    rig.plant = random_plant(draw);
    rig.control = read_gain_file(config / "gains" / "exponential.yaml");
    rig.control.sample_rate_hz = draw.any_of({200.0, 500.0, 1000.0, 2000.0});
    rig.theta0_rad = draw.uniform(-0.08, 0.08);
  } while (!stabilized(draw, rig));
  return rig;
}

/// How a run of 10 s ends. The track has no end, so that nothing but the watch and a fall stop it.
LoopOutcome end_of(const BalancedRig& balanced, Sticks what = Sticks::nothing, double from_s = 0.0) {
  RigFile rig = read_rig_file(config / "rigs" / "simulated.yaml");
  VirtualClock clock;
  const auto simulated = make_simulated_rig(rig, balanced.plant, clock, {1, balanced.theta0_rad});
  simulated->open();
  const double rate_hz = balanced.control.sample_rate_hz;
  StickingRig sticking(*simulated, what, static_cast<std::uint64_t>(from_s * rate_hz));
  Controller controller(balanced.control, rig.amplifier.limit_v);
  PoseScaler scaler(calibration_in_use(rig));
  LoopLimits limits = rig_limits(rig, balanced.plant);
  limits.periods = static_cast<std::uint64_t>(10.0 * rate_hz);
  limits.track_limit_m = 100.0;
  limits.max_periods_late = 1;
  RowMemory memory;
  const SignalFlag no_signal{0};
  LiveStatus live;
  ControlLoop loop(sticking, clock, controller, scaler, memory, limits, no_signal, live);
  LoopOutcome outcome;
  loop.run(outcome);
  return outcome;
}

TEST(EncoderWatchOnRigs, StopsNoneOfAThousandWhoseEncodersCount) {
  for (std::uint64_t seed = 1; seed <= 1000; ++seed)
    ASSERT_NE(end_of(random_rig(seed)).reason, StopReason::stuck_encoder) << "seed " << seed;
}

/// The rigs of the false stops that led here: 5 ms of input delay, 6 ms of motor lag, the paper's gain.
TEST(EncoderWatchOnRigs, LetsACartRestUnderFrictionAndLag) {
  for (const char* kind : {"input_delay", "motor_lag"})
    for (const double lag_s : {0.005, 0.006, 0.008}) {
      BalancedRig rig{read_plant_file(config / "plants" / "exponential.yaml"),
                      read_gain_file(config / "gains" / "exponential.yaml")};
      rig.plant.set(kind, {lag_s});
      for (const double theta0_rad : {0.01, 0.02, 0.05}) {
        rig.theta0_rad = theta0_rad;
        EXPECT_EQ(end_of(rig).reason, StopReason::duration) << kind << " " << lag_s << " " << theta0_rad;
      }
    }
}

TEST(EncoderWatchOnRigs, FindsAStuckEncoderInTime) {
  constexpr double within_s = 2.5;
  for (const char* name : {"exponential.yaml", "dynamic.yaml"})
    for (const double rate_hz : {200.0, 500.0, 1000.0})
      for (int i = 0; i < 20; ++i) {
        BalancedRig rig{read_plant_file(config / "plants" / name),
                        read_gain_file(config / "gains" / "exponential.yaml")};
        rig.control.sample_rate_hz = rate_hz;
        const double from_s = 0.2 + 0.237 * i;
        for (const Sticks what : {Sticks::cart, Sticks::pendulum}) {
          const LoopOutcome outcome = end_of(rig, what, from_s);
          EXPECT_EQ(outcome.reason, StopReason::stuck_encoder);
          EXPECT_EQ(outcome.stuck, what == Sticks::cart ? StuckEncoder::cart : StuckEncoder::pendulum);
          EXPECT_LT(outcome.time_s - from_s, within_s)
              << name << " at " << rate_hz << " Hz, " << (what == Sticks::cart ? "cart" : "pendulum")
              << " from " << from_s << " s";
        }
      }
}

}  // namespace
}  // namespace upright
