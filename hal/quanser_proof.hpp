// Whether a Quanser card does what a rig needs of it, step by step, at zero volts.
#pragma once

#include <string>
#include <vector>

#include "upright/hal/rig_file.hpp"

namespace upright {

struct CardStep {
  std::string subject;  ///< "Quanser card's watchdog", ...
  bool passed = false;
  std::string what;
  std::string remedy;  ///< empty where it passed
};

/// Library, board, output, encoders and watchdog, in this order; the first that fails is the last. The
/// watchdog is let expire on purpose, seen to lock the card, and cleared. The card is closed again, at zero
/// volts.
std::vector<CardStep> prove_quanser_card(const RigFile& rig);

}  // namespace upright
