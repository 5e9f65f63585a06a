// Cases for the diagnosis: a plant file that is believed, a true rig that differs from it by hidden effects,
// and the runs that were made. Everything follows from a request and its seed.
// effect_sizes.hpp says how large hidden effects are.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "blind_run.hpp"
#include "effect_sizes.hpp"

namespace upright::blind {

/// What is unmodelled on a rig beside what is hidden.
enum class Condition {
  quantized,   ///< nothing but the sensors' steps
  disturbed,   ///< a force of 0.05 N and 10 Hz, and jitter
  laboratory,  ///< see laboratory.hpp
};

std::string_view name_of(Condition condition);

struct HiddenEffect {
  std::size_t effect = 0;
  std::vector<double> values;
};

struct Request {
  std::vector<std::string>
      hidden;  ///< kinds of the registry, or one of `unknown_kinds`; empty: nothing is hidden
  Size size = Size::typical;
  std::uint64_t seed = 1;
  Condition condition = Condition::quantized;
  int runs = 0;  ///< 0: by the seed
  double max_samples = 12000.0;
  double rate_hz = 0.0;     ///< 0: by the seed
  double duration_s = 0.0;  ///< of each run; 0: by the seed
};

/// The seed of a case of a matrix, from the seed of the matrix and the number of the case.
constexpr std::uint64_t seed_of_case(std::uint64_t matrix_seed, std::uint64_t number) {
  return matrix_seed * 1000003 + number;
}

/// For a rig of a laboratory.
Request laboratory_request(std::uint64_t seed, std::vector<std::string> hidden = {});

struct Case {
  Request request;
  Plant believed;  ///< the plant file
  Rig rig;
  std::vector<HiddenEffect> hidden;
  std::vector<Plan> plans;
  std::string campaign;  ///< what kind of runs, in words
};

/// What no effect of the registry describes: kinds that may be hidden under a condition. Of a laboratory,
/// those that the registry does not have in the meantime.
std::vector<std::string> unknown_kinds(Condition condition);

/// Effects of the registry that may be hidden together as a pair: structural ones that are not the same
/// force.
std::vector<std::string> random_pair(std::uint64_t seed);

Case make_case(const Request& request);

/// The runs of the believed plant: what moves in them sets the sizes.
Scales rehearse(const Case& blind);

/// The plant of the rig before anything is hidden: each number of the file is off by up to this share.
Plant nearly_as_believed(const Case& blind, double off, Random& random);

/// Hides what the request asks for, in the plant of the rig or elsewhere in the rig.
void hide_effects(Case& blind, const Scales& scales, Plant& truth, Random& random);

/// What the plant file says about dry friction: the chance that it has a level.
double chance_of_known_dry_friction(const Request& request, double otherwise);

/// The kind of runs, and the experiment of one of them.
std::string choose_campaign(const Request& request, double rate_hz, Random& random);
Experiment choose_experiment(const std::string& campaign, double rate_hz, int run, int runs, Random& random);

/// Makes the runs. `without_unknown`: of the same rig and the same seeds without what the registry lacks.
std::vector<Measurement> measure_all(const Case& blind, bool without_unknown = false);

}  // namespace upright::blind
