// How large an effect is that is hidden in a rig.
//
// Sizes are set by the plant's own forces in these runs, not by what a diagnosis finds: a run of the believed
// plant gives the motor's force, speed, travel and swing (root mean square of the run with the largest), and
// an effect takes a share of them: 3, 10 or 25 percent of the motor's force for what acts on the cart; 1, 3
// or 10 percent of gravity's torque for what acts in the pivot; 3, 10 or 25 percent of the plant's time
// constant for delays.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "random_draw.hpp"
#include "upright/measurement/measurement.hpp"
#include "upright/model/plant.hpp"

namespace upright::blind {

enum class Size { weak, typical, strong };

std::string_view name_of(Size size);

inline double pick(Size size, double weak, double typical, double strong) {
  return size == Size::weak ? weak : size == Size::typical ? typical : strong;
}

/// What moves in the runs of the believed plant: root mean square of the run with the largest.
struct Scales {
  double force_n = 0.0, volts = 0.0, high_volts = 0.0;
  double speed_mps = 0.0, travel_m = 0.0, center_m = 0.0;
  double gravity_torque_nm = 0.0, rate_radps = 0.0;
};

Scales scales_of(const Plant& plant, const std::vector<Measurement>& runs);

/// Friction in proportion to the speed, with the back-EMF.
double damping_of(const Plant& plant);

/// Effects of the registry that have a size here, and so can be hidden, in the order in which rounds draw
/// them. A list of its own: an effect that is new in the registry does not change the cases of a seed.
const std::vector<std::string>& hidden_kinds();

/// The parameters of a hidden effect, in their declared order.
std::vector<double> values_for(const std::string& kind, Size size, const Plant& plant, const Scales& s,
                               Random& random);

}  // namespace upright::blind
