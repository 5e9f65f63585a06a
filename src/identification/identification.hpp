// Friction and motor constants of a cart from measured runs: direct readings first (breakaway from ramps,
// speeds at constant voltages, the balance of forces), then a fit of the whole model that starts there.
#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "force_balance.hpp"
#include "upright/diagnosis/diagnosis.hpp"
#include "upright/estimation/fit.hpp"

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
  /// `explained`: what the model leaves is noise, and what two thirds of the runs say accounts for the others
  /// too; the numbers are the rig's. `unexplained`: something else moves the rig, and the numbers make up for
  /// it. `not_excited`: the data cannot show it.
  Verdict verdict = Verdict::unexplained;
  /// A signal ended it: the numbers are the best so far, of which nothing is known.
  bool interrupted = false;
  /// Held-out simulation error over the noise floor, as in a Diagnosis: of the plant as given, and of the
  /// identified model fitted to the other runs. Not a number: not measured.
  double gap_before = std::numeric_limits<double>::quiet_NaN();
  double gap_after = std::numeric_limits<double>::quiet_NaN();
  std::string residual;  ///< what is left, in words
  /// Whether the numbers may be used.
  bool is_trustworthy() const { return verdict == Verdict::explained && !interrupted; }

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
  /// Once it is not zero the work is given up, within some tenths of a second. Null: never.
  const std::atomic<int>* signal = nullptr;
  std::function<void(double, const std::string&)> progress;
};

/// `base` gives masses, length and the motor's force per volt; its effects of friction are estimated anew.
/// The result does not depend on the order of the runs. The force per volt is the scale of every force, so
/// the cart's mass is estimated and not believed. Its work is bounded: a few thousand times what following
/// some ten thousand samples takes, however many there are.
Identification identify(const Plant& base, const std::vector<Measurement>& runs,
                        const IdentificationOptions& options = {});

}  // namespace upright
