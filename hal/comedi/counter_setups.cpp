#include "counter_setups.hpp"

#include <algorithm>

namespace upright {

namespace {

using Line = CounterStep::Line;

// drivers/comedi/drivers/s626.c, s626_enc_insn_config: whatever is configured, the counter becomes a
// quadrature counter (one count per cycle of A), is loaded with the first datum, which is no instruction
// here, and enabled.
constexpr std::array<CounterStep, 1> s626_steps = {{{INSN_CONFIG, 0, {0}, 1, Line::none, false}}};

// demo/gpct_encoder.c of comedilib, with drivers/comedi/drivers/ni_tio.c. The 660x drivers refuse to name a
// source for a gate that is off, but have switched it off by then.
constexpr lsampl_t count_mode =
    NI_GPCT_COUNTING_MODE_QUADRATURE_X4_BITS | NI_GPCT_COUNTING_DIRECTION_HW_UP_DOWN_BITS;
constexpr CounterStep reset = {INSN_CONFIG, 0, {INSN_CONFIG_RESET}, 1, Line::none, false};
constexpr CounterStep load_count = {INSN_WRITE, 0, {0}, 1, Line::none, false};
constexpr CounterStep load_a = {INSN_WRITE, 1, {0}, 1, Line::none, false};
constexpr CounterStep load_b = {INSN_WRITE, 2, {0}, 1, Line::none, false};
constexpr CounterStep no_gate = {
    INSN_CONFIG, 0, {INSN_CONFIG_SET_GATE_SRC, 0, NI_GPCT_DISABLED_GATE_SELECT}, 3, Line::none, true};
constexpr CounterStep no_second_gate = {
    INSN_CONFIG, 0, {INSN_CONFIG_SET_GATE_SRC, 1, NI_GPCT_DISABLED_GATE_SELECT}, 3, Line::none, true};
constexpr CounterStep quadrature = {INSN_CONFIG, 0,          {INSN_CONFIG_SET_COUNTER_MODE, count_mode},
                                    2,           Line::none, false};
constexpr CounterStep arm = {INSN_CONFIG, 0, {INSN_CONFIG_ARM, NI_GPCT_ARM_IMMEDIATE}, 2, Line::none, false};

// The three sources exist on the M series only. The E series has the same driver and takes the mode without a
// word, but cannot count in quadrature: that these are not refused is what tells the two apart.
constexpr CounterStep line_a = {
    INSN_CONFIG, 0, {INSN_CONFIG_SET_OTHER_SRC, NI_GPCT_SOURCE_ENCODER_A, 0}, 3, Line::a, false};
constexpr CounterStep line_b = {
    INSN_CONFIG, 0, {INSN_CONFIG_SET_OTHER_SRC, NI_GPCT_SOURCE_ENCODER_B, 0}, 3, Line::b, false};
constexpr CounterStep no_index = {
    INSN_CONFIG,
    0,
    {INSN_CONFIG_SET_OTHER_SRC, NI_GPCT_SOURCE_ENCODER_Z, NI_GPCT_DISABLED_OTHER_SELECT},
    3,
    Line::none,
    false};

constexpr std::array ni_pcimio_steps = {reset,  load_count, load_a,   load_b,     no_gate, no_second_gate,
                                        line_a, line_b,     no_index, quadrature, arm};
// The 660x counters have fixed inputs: A is the source, B the up/down line.
constexpr std::array ni_660x_steps = {reset,   load_count,     load_a,     load_b,
                                      no_gate, no_second_gate, quadrature, arm};

// multiq3 sets its counters up when it is attached, and shows the reset value in the middle of the range;
// they are left alone here, so that they go on counting from run to run.
constexpr std::array<CounterSetup, 4> setups = {{
    {"multiq3", 0x800000, false, false, false, {}},
    {"s626", 0, true, false, false, s626_steps},
    {"ni_pcimio", 0, true, true, true, ni_pcimio_steps},
    {"ni_660x", 0, true, false, true, ni_660x_steps},
}};

}  // namespace

const CounterSetup* counter_setup(const std::string& driver) noexcept {
  const auto found = std::find_if(setups.begin(), setups.end(),
                                  [&](const CounterSetup& setup) { return driver == setup.driver; });
  return found == setups.end() ? nullptr : &*found;
}

std::string known_counter_drivers() {
  std::string names;
  for (const CounterSetup& setup : setups) names += (names.empty() ? "" : ", ") + std::string(setup.driver);
  return names;
}

}  // namespace upright
