// The bank of candidate effects: every effect of the registry that the plant and the data can have, with what
// is believed of its parameters beforehand and where a search for them starts.
#pragma once

#include <vector>

#include "estimation/fit.hpp"
#include "periodic_starts.hpp"
#include "search_budget.hpp"
#include "selection_policy.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// What the runs can show at all: decides which effects are candidates and where searches start.
struct DataRange {
  std::vector<QuantityRange> measured;  ///< of each quantity that some run measured
  bool cart_moves = false;              ///< some run has a free cart that is measured
  bool theta_measured = false;
  double cart_mass_kg = 0.0;  ///< as in the plant file
  double largest_voltage_v = 0.0;
  double largest_force_n = 0.0;    ///< of the motor at that voltage
  double motor_force_rms_n = 0.0;  ///< root mean square, in the run that the motor drives most
  double largest_speed_mps = 0.0;
  double cart_low_m = 0.0, cart_high_m = 0.0;
  double longest_travel_m = 0.0;   ///< of one run
  double longest_run_s = 0.0;      ///< from the first to the last sample of a run
  double longest_segment_s = 0.0;  ///< the same of what a fit follows from one initial state
  double cart_mean_m = 0.0;
  double shortest_period_s = 0.0;
  double theta_resolution_rad = 0.0;
  double theta_step_rad = 0.0;       ///< of an encoder as precise as the sensor of the angle
  double gravity_torque_nm = 0.0;    ///< the largest on the pendulum; 0 without one
  double pendulum_rate_radps = 0.0;  ///< of its small swings while it hangs
};

DataRange range_of(const std::vector<Measurement>& runs, const Plant& plant, const ExcitationPolicy& policy);

/// The usual size of a force in these runs [N], and of a torque on the pivot [N m]; 0 without a pendulum.
double usual_force_n(const DataRange& range, const PriorPolicy& prior);
double usual_torque_nm(const DataRange& range, const PriorPolicy& prior);

/// [1] Of the largest voltage: the highest limit at which the search for a saturation starts. Chosen.
inline constexpr double highest_saturation_start = 0.9;

/// Whether anything moved far enough to show an effect: well beyond the sensors' steps.
bool moves_enough(const std::vector<Measurement>& runs, const ExcitationPolicy& policy);

/// The parameters of an effect as free ones.
std::vector<FreeParameter> free_parameters(std::size_t effect, const DataRange& range,
                                           const PriorPolicy& prior);

/// A correction of something the plant file already says, with the belief that it is a few percent off at
/// most.
std::vector<FreeParameter> correction_parameters(const Plant& plant, std::size_t effect,
                                                 const DataRange& range, const PriorPolicy& prior);

/// Corrections that every fit leaves room for: the base parameters (cart_mass, ...) that these data can show,
/// and the zero of the angle within a count.
std::vector<std::size_t> base_corrections(const Plant& plant, const DataRange& range);

/// Effects that could be added to the plant, in the registry's order: those it does not have.
std::vector<std::size_t> candidate_effects(const Plant& plant, const DataRange& range);

/// Of the effects that attach a mass to the cart, those that could be added. They are not among the others:
/// a mass on a spring fits the part of any random force that is near its frequency.
std::vector<std::size_t> attached_mass_candidates(const Plant& plant, const DataRange& range);

/// Whether `a` is the plainer of two effects that explain the same: fewer parameters; of the names of one and
/// the same force (docs/reference/effects.md) the one that supposes least; else the one registered first.
bool is_plainer(std::size_t a, std::size_t b);

/// The other names of one and the same force (docs/reference/effects.md); empty for an effect that has none.
std::vector<std::size_t> same_force_as(std::size_t effect);
/// Whether both are one and the same force, and `a` supposes less.
bool is_plainer_name(std::size_t a, std::size_t b);

/// Parameter values from which to search for an effect; several where the misfit has several valleys.
/// Of an effect that is periodic along the track, any: periodic_starts() knows better.
std::vector<std::vector<double>> search_starts(std::size_t effect, const DataRange& range,
                                               const PriorPolicy& prior, const SearchBudget& budget);

}  // namespace upright
