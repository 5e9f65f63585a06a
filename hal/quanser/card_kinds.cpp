#include "card_kinds.hpp"

#include <algorithm>
#include <array>

namespace upright {

namespace {

constexpr double shortest_s = 1e-6, longest_s = 10.0;  // where the card's own limits are not known

// Q2-USB: a watchdog of 16 bits of 125 us, counters of 16 bits. Q8: a 32-bit counter of 60 ns; "the digital
// outputs must also be configured to go tristate" for 0 V at the analog ones (Quanser's documentation of
// hil_watchdog_set_analog_expiration_state and of the Q8).
constexpr std::array<QuanserCardKind, 4> card_kinds = {{
    {"q2_usb", 2, 2, 16, 125e-6, 8.1, 0},
    {"q8_usb", 8, 8, 0, shortest_s, longest_s, 0},
    {"qpid_e", 8, 8, 0, shortest_s, longest_s, 0},
    {"q8", 8, 8, 0, shortest_s, longest_s, 32},
}};

}  // namespace

const QuanserCardKind* quanser_card_kind(const std::string& board_type) noexcept {
  const auto* const found =
      std::find_if(card_kinds.begin(), card_kinds.end(),
                   [&](const QuanserCardKind& kind) { return board_type == kind.board_type; });
  return found == card_kinds.end() ? nullptr : found;
}

}  // namespace upright
