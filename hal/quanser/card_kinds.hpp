// What is known of Quanser's cards by their type. Cards that are not here work too, without these checks.
#pragma once

#include <string>

namespace upright {

struct QuanserCardKind {
  const char* board_type;
  int encoders;
  int analog_outputs;
  int counter_bits;  ///< of its encoder counters; 0: 32, or not known
  double shortest_watchdog_s, longest_watchdog_s;
  /// The expired watchdog takes the analog outputs to zero only where so many digital lines go tri-state too;
  /// 0: no such condition.
  int tristate_lines;
};

/// Null for a card that is not in the table.
const QuanserCardKind* quanser_card_kind(const std::string& board_type) noexcept;

}  // namespace upright
