// Friction and motor constants of a cart from measured runs: first direct readings (breakaway from ramps,
// speeds at constant voltages, force balance), then a fit of the complete model that starts from them.
#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "estimation/fit.hpp"
#include "force_balance.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// An identified parameter.
struct IdentifiedParameter {
  std::string name;  ///< e.g. coulomb_friction.force_n, cart_mass_kg, breakaway_n
  std::string unit;
  double value = 0.0;
  double low = 0.0, high = 0.0;  ///< 95 percent
  std::string source;            ///< what in the data determines it
  std::string goodness;          ///< how accurately, as text
};

struct Identification {
  /// `explained`: the residual is noise, and a model of two thirds of the runs accounts for the others; the
  /// parameters are valid for the rig. `unexplained`: another effect acts on the rig, and the parameters
  /// compensate for it. `not_excited`: the data cannot show the parameters.
  Verdict verdict = Verdict::unexplained;
  /// A signal ended the work: the parameters are the best so far and were not tested.
  bool interrupted = false;
  /// Held-out simulation error divided by the noise floor, as in a Diagnosis: of the plant as given, and of
  /// the identified model fitted to the other runs. NaN if not measured.
  double gap_before = std::numeric_limits<double>::quiet_NaN();
  double gap_after = std::numeric_limits<double>::quiet_NaN();
  std::string residual;  ///< the residual, as a sentence
  /// Whether the parameters may be used.
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
  /// When it becomes nonzero, the work ends within some tenths of a second. May be null.
  const std::atomic<int>* signal = nullptr;
  std::function<void(double, const std::string&)> progress;
};

/// `base` gives masses, length and the motor's force per volt; its friction is estimated again. The result
/// does not depend on the order of the runs. The force per volt is the scale of every force, so the cart's
/// mass is estimated without a prior. The work is bounded: some ten thousand samples are followed a few
/// thousand times, for any amount of data.
Identification identify(const Plant& base, const std::vector<Measurement>& runs,
                        const IdentificationOptions& options = {});

}  // namespace upright
