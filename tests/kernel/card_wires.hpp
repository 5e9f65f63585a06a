// A rig on Comedi cards alone: the motor is channel 0 of the first card, cart and pendulum are channels 0 and
// 1 of the second. Two cards, for a locked output keeps everybody else from its neighbours.
#pragma once

#include <string>

#include "../integration/virtual_rig_process.hpp"
#include "comedi_card.hpp"
#include "upright/base/yaml_reader.hpp"
#include "wires.hpp"

namespace upright::test {

struct CardScales {
  static constexpr double cart_counts_per_v = 2000.0, pendulum_counts_per_v = 400.0;
  static constexpr double amplifier_gain = 1.5;  // 15 V at the motor are 10 V at the card
};

inline const Pose card_rig_start{0.0, 0.05};

/// The rig file; both encoders are potentiometers.
inline std::string card_rig_text(const std::string& output_range = "[-10, 10]") {
  return "backend: comedi\n"
         "calibration:\n"
         "  cart: {m_per_count: 2.27485e-5, sign: 1, width_bits: 32, fastest_mps: 5}\n"
         "  pendulum: {counts_per_revolution: 4096, sign: 1, width_bits: 32, fastest_radps: 60}\n"
         "  zero: {at: counts, cart_counts: 0, pendulum_counts: 0, pose: upright}\n"
         "amplifier: {limit_v: 12, sign: 1}\n"
         "track: {limit_m: 0.39, coast_s: 0.1}\n"
         "fall_angle_rad: 0.6\n"
         "encoder_watch: {breakaway_v: {from: 0.3, to: 1.2}, largest_lag_s: 0.01, "
         "acceleration_mps2_per_v: 1.1, damping_v_per_mps: 9.5, longest_pendulum_m: 0.7}\n"
         "watchdog_s: 0.1\n"
         "comedi:\n"
         "  cart: {kind: analog_input, device: /dev/comedi1, subdevice: 0, channel: 0, range_v: [-10, 10],\n"
         "         counts_per_v: " +
         exact_text(CardScales::cart_counts_per_v) +
         "}\n"
         "  pendulum: {kind: analog_input, device: /dev/comedi1, subdevice: 0, channel: 1, range_v: [-10, "
         "10],\n"
         "             counts_per_v: " +
         exact_text(CardScales::pendulum_counts_per_v) +
         "}\n"
         "  output: {device: /dev/comedi0, subdevice: 1, channel: 0, range_v: " +
         output_range + ", amplifier_gain: " + exact_text(CardScales::amplifier_gain) + "}\n";
}

/// The same rig with counters of 16 bits, which are close to their ends where the rig is in its middle.
inline std::string counter_rig_text() {
  std::string text = card_rig_text();
  for (const std::string channel : {"0", "1"}) {
    const std::size_t kind = text.find("kind: analog_input");
    const std::size_t end = text.find('}', kind);
    text.replace(kind, end - kind,
                 "kind: plain_counter, device: /dev/comedi1, subdevice: 0, channel: " + channel);
    text = replaced(text, "width_bits: 32", "width_bits: 16");
  }
  return replaced(text, "cart_counts: 0, pendulum_counts: 0", "cart_counts: 32760, pendulum_counts: -32768");
}

class CardWires final : public Wires {
 public:
  enum class Encoders : std::uint8_t { potentiometers, counters };

  explicit CardWires(Encoders kind) : kind_(kind) {
    output_.put(0, ComediCardUnderTest::middle);  // the driver begins a step below
  }

  double motor_v(std::int64_t) override {
    return CardScales::amplifier_gain * ComediCardUnderTest::volts_of(output_.seen(0));
  }

  void show(const EncoderCounts& counts) override {
    if (mishap_ != Mishap::cart_sticks) show_cart(counts.cart);
    if (mishap_ != Mishap::pendulum_sticks) put(1, counts.pendulum, CardScales::pendulum_counts_per_v);
  }

  void suffer(Mishap mishap) override {
    mishap_ = mishap;
    if (mishap == Mishap::encoders_go) encoders_.detach();
  }

  bool at_rest() const override { return output_.seen(0) == ComediCardUnderTest::middle; }

 private:
  void show_cart(std::int64_t counts) {
    constexpr std::int64_t jump_counts = 5000;
    if (mishap_ == Mishap::cart_has_no_contact)
      encoders_.put(0, ComediCardUnderTest::top);
    else
      put(0, mishap_ == Mishap::cart_jumps ? counts + jump_counts : counts, CardScales::cart_counts_per_v);
  }

  void put(unsigned int channel, std::int64_t counts, double counts_per_v) {
    encoders_.put(channel, kind_ == Encoders::counters
                               ? static_cast<lsampl_t>(counts) & ComediCardUnderTest::top
                               : ComediCardUnderTest::datum_of(static_cast<double>(counts) / counts_per_v));
  }

  Encoders kind_;
  ComediCardUnderTest output_{"/dev/comedi0"}, encoders_{"/dev/comedi1"};
  Mishap mishap_ = Mishap::none;
};

}  // namespace upright::test
