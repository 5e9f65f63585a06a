// The range of the quantities that runs measured. A model is not tested beyond the range of the runs that it
// was fitted to.
#pragma once

#include <vector>

#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// `cart_m`, `cart_mps`, `theta_rad`, `theta_radps` and `voltage_v`, each if some run measured it. Speeds are
/// differences over `speed_window_s`. The voltage of a locked cart does not count.
std::vector<QuantityRange> motion_range(const std::vector<Measurement>& runs, double speed_window_s);

/// The quantities of `run` that exceed `fitted` at either end by more than a tenth of its width, with their
/// range in the run.
std::vector<QuantityRange> beyond_range(const std::vector<QuantityRange>& run,
                                        const std::vector<QuantityRange>& fitted);

/// In words: "cart_m -0.1 to 0.1 m, voltage_v -4 to 4 V".
std::string range_text(const std::vector<QuantityRange>& ranges);

}  // namespace upright
