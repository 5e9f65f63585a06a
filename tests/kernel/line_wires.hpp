// A rig on lines: the pendulum's counts come as edges, the motor obeys the enable line and an external
// watchdog on the heartbeat. The cart is channel 0 of the second Comedi card, the motor's voltage channel 0
// of the first.
#pragma once

#include <atomic>
#include <numbers>
#include <string>

#include "../integration/virtual_rig_process.hpp"
#include "comedi_card.hpp"
#include "gpio_sim.hpp"
#include "shaft.hpp"
#include "wires.hpp"

namespace upright::test {

struct LineNumbers {
  static constexpr int stop = 0, plus = 1, minus = 2, enable = 3, beat = 4, a = 5, b = 6;
};

/// The part of a rig file that any rig may have.
inline const std::string lines_text =
    "gpio:\n"
    "  chip: rig\n"
    "  emergency_stop: {line: 0, active: high}\n"
    "  limit_switches:\n"
    "    - {end: plus_x, line: 1, active: high}\n"
    "    - {end: minus_x, line: 2, active: low}\n"
    "  amplifier_enable: {line: 3, active: high}\n"
    "  heartbeat: {line: 4}\n";

/// A simulated rig with real lines.
inline std::string simulated_rig_text() {
  const std::string config = UPRIGHT_SOURCE_DIR "/config/";
  return replaced(text_of(config + "rigs/simulated.yaml"), "../plants", config + "plants") + lines_text;
}

/// Line encoders count from where they are: by its zero the rig begins leaning.
inline const Pose line_rig_start{0.0, 33.0 * 2.0 * std::numbers::pi / 4096.0};

inline const std::string line_rig_text =
    "backend: {cart_encoder: comedi, pendulum_encoder: gpio, output: comedi}\n"
    "calibration:\n"
    "  cart: {m_per_count: 2.27485e-5, sign: 1, width_bits: 32, fastest_mps: 5}\n"
    "  pendulum: {counts_per_revolution: 4096, sign: 1, width_bits: 32, fastest_radps: 60}\n"
    "  zero: {at: counts, cart_counts: 0, pendulum_counts: -33, pose: upright}\n"
    "amplifier: {limit_v: 10, sign: 1}\n"
    "track: {limit_m: 0.39, coast_s: 0.1}\n"
    "fall_angle_rad: 0.6\n"
    "encoder_watch: {breakaway_v: {from: 0.3, to: 1.2}, largest_lag_s: 0.01, "
    "acceleration_mps2_per_v: 1.1, damping_v_per_mps: 9.5, longest_pendulum_m: 0.7}\n"
    "watchdog_s: 0.1\n"
    "comedi:\n"
    "  cart: {kind: analog_input, device: /dev/comedi1, subdevice: 0, channel: 0, range_v: [-10, 10],\n"
    "         counts_per_v: 2000}\n"
    "  output: {device: /dev/comedi0, subdevice: 1, channel: 0, range_v: [-10, 10], amplifier_gain: 1}\n" +
    lines_text + "  pendulum_encoder: {a: 5, b: 6, fastest_edges_per_s: 4000}\n";

/// Takes the voltage away when the heart does not beat.
class ExternalWatchdog {
 public:
  static constexpr std::int64_t patience_ns = 100'000'000;
  bool alive(bool level, std::int64_t now_ns) {
    if (level != level_) {
      level_ = level;
      beat_ns_ = now_ns;
      ++beats_;
    }
    return now_ns - beat_ns_ < patience_ns;
  }
  int beats() const { return beats_; }

 private:
  bool level_ = false;
  std::int64_t beat_ns_ = -patience_ns;
  std::atomic<int> beats_{0};
};

class LineWires final : public Wires {
 public:
  LineWires() {
    sim_.pull(LineNumbers::minus, true);
    output_.put(0, ComediCardUnderTest::middle);  // the driver begins a step below
  }

  double motor_v(std::int64_t now_ns) override {
    const double voltage_v = ComediCardUnderTest::volts_of(output_.seen(0));
    // Of a chip that has gone nothing is known: the worst is an amplifier that stays on.
    if (is_gone_) return voltage_v;
    const bool alive = watchdog_.alive(sim_.level(LineNumbers::beat), now_ns);
    return alive && sim_.level(LineNumbers::enable) ? voltage_v : 0.0;
  }

  void show(const EncoderCounts& counts) override {
    constexpr double cart_counts_per_v = 2000.0;
    constexpr std::int64_t jump_counts = 5000;
    const std::int64_t cart = mishap_ == Mishap::cart_jumps ? counts.cart + jump_counts : counts.cart;
    if (mishap_ != Mishap::cart_sticks)
      cart_.put(0, ComediCardUnderTest::datum_of(static_cast<double>(cart) / cart_counts_per_v));
    if (mishap_ != Mishap::pendulum_sticks && !is_gone_) shaft_.turn_to(counts.pendulum);
  }

  void suffer(Mishap mishap) override {
    constexpr std::int64_t rattle_counts = 200, burst_counts = 550;  // forth and back are 1100 edges
    mishap_ = mishap;
    switch (mishap) {
      case Mishap::encoder_rattles:
        return swing(rattle_counts);
      case Mishap::edges_burst:
        return swing(burst_counts);
      case Mishap::encoders_go:
        sim_.unplug();
        is_gone_ = true;
        return;
      case Mishap::emergency_stop:
        return sim_.pull(LineNumbers::stop, true);
      case Mishap::plus_switch:
        return sim_.pull(LineNumbers::plus, true);
      case Mishap::minus_switch:
        return sim_.pull(LineNumbers::minus, false);
      default:
        return;
    }
  }

  bool at_rest() const override {
    return output_.seen(0) == ComediCardUnderTest::middle && (is_gone_ || !sim_.level(LineNumbers::enable));
  }
  bool is_enabled() const { return sim_.level(LineNumbers::enable); }
  int beats() const { return watchdog_.beats(); }

 private:
  /// Forth and back at once, as no pendulum does.
  void swing(std::int64_t counts) {
    const std::int64_t now = shaft_.counts();
    shaft_.turn_to(now + counts);
    shaft_.turn_to(now);
  }

  GpioSim sim_{"rig", 8};
  Shaft shaft_{sim_, LineNumbers::a, LineNumbers::b};
  ComediCardUnderTest output_{"/dev/comedi0"}, cart_{"/dev/comedi1"};
  ExternalWatchdog watchdog_;
  std::atomic<Mishap> mishap_{Mishap::none};
  std::atomic<bool> is_gone_{false};
};

}  // namespace upright::test
