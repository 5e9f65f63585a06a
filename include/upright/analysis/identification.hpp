// Friction and motor constants of a cart from measured runs: direct readings first (breakaway from ramps,
// speeds at constant voltages, the balance of forces), then a fit of the whole model that starts there.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "upright/analysis/fit.hpp"
#include "upright/analysis/force_balance.hpp"

namespace upright {

/// A number that was identified.
struct IdentifiedParameter {
  std::string name;  ///< e.g. coulomb_friction.force_n, cart_mass_kg, breakaway_n
  std::string unit;
  double value = 0.0;
  double low = 0.0, high = 0.0;  ///< 95 percent
  std::string source;            ///< what in the data shows it
  std::string goodness;          ///< how well, in words with numbers
};

struct Identification {
  Plant plant;
  std::vector<IdentifiedParameter> parameters;
  std::vector<Breakaway> breakaways;
  std::vector<SteadyPoint> steady_points;
  std::optional<ForceBalance> balance;
  Noise noise;
  double rms = 0.0;  ///< of the innovations, in units of the noise
  std::vector<std::string> notes;
};

struct IdentificationOptions {
  std::function<void(double, const std::string&)> progress;
};

/// `base` gives masses, length and the motor's force per volt; its effects of friction are estimated anew.
/// The result does not depend on the order of the runs. The force per volt is the scale of every force, so
/// the cart's mass is estimated and not believed. Throws ConfigError where the runs show nothing.
Identification identify(const Plant& base, const std::vector<Measurement>& runs,
                        const IdentificationOptions& options = {});

}  // namespace upright
