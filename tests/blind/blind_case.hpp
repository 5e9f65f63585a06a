// Cases for the diagnosis: a plant file that is believed, a true rig that differs from it by hidden effects,
// and the runs that were made. Everything follows from a request and its seed.
//
// Sizes are set by the plant's own forces in these runs, not by what a diagnosis finds: a run of the believed
// plant gives the motor's force, speed, travel and swing (root mean square of the liveliest run), and an
// effect takes a share of them: 3, 10 or 25 percent of the motor's force for what acts on the cart; 1, 3 or
// 10 percent of gravity's torque for what acts in the pivot; 3, 10 or 25 percent of the plant's time constant
// for delays.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "blind_run.hpp"

namespace upright::blind {

enum class Size { weak, typical, strong };

std::string_view name_of(Size size);

struct HiddenEffect {
  std::size_t effect = 0;
  std::vector<double> values;
};

struct Request {
  std::vector<std::string>
      hidden;  ///< kinds of the registry, or one of `unknown_kinds`; empty: nothing is hidden
  Size size = Size::typical;
  std::uint64_t seed = 1;
  bool disturbed = false;  ///< 0.05 N, 10 Hz, and jitter
  int runs = 0;            ///< 0: by the seed
  double most_samples = 12000.0;
  double rate_hz = 0.0;     ///< 0: by the seed
  double duration_s = 0.0;  ///< of each run; 0: by the seed
};

struct Case {
  Request request;
  Plant believed;  ///< the plant file
  Rig rig;
  std::vector<HiddenEffect> hidden;
  std::vector<Plan> plans;
  std::string campaign;  ///< what kind of runs, in words
};

/// What no effect of the registry describes.
const std::vector<std::string>& unknown_kinds();

/// Effects of the registry that may be hidden together as a pair: structural ones that are not the same
/// force.
std::vector<std::string> random_pair(std::uint64_t seed);

Case make_case(const Request& request);

/// Makes the runs. `without_unknown`: of the same rig and the same seeds without what the registry lacks.
std::vector<Measurement> measure_all(const Case& blind, bool without_unknown = false);

}  // namespace upright::blind
