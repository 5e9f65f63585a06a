// The page of a simulation: the error of each channel, and measured and simulated curves over each other.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "estimation/simulation.hpp"

namespace upright {

/// What was simulated, for the head of the page.
struct SimulationTitle {
  std::string plant;       ///< its file
  std::string controller;  ///< the gain file of a closed loop; empty: under the recorded voltages
};

/// Writes the page. Throws Error.
void write_simulation_report(const SimulationTitle& title, const std::vector<Measurement>& runs,
                             const std::vector<RunSimulation>& simulations,
                             const std::filesystem::path& file);

}  // namespace upright
