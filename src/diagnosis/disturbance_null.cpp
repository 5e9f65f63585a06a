#include "disturbance_null.hpp"

#include "coloured_null.hpp"
#include "place_null.hpp"

namespace upright {

std::optional<OutdoneEffect> outdone_by_disturbance(Search& search, const Hypothesis& known,
                                                    const Hypothesis& judged,
                                                    const std::vector<Reproduction>& effects) {
  if (const auto effect = outdone_by_coloured_noise(search, known, effects))
    return OutdoneEffect{*effect, "a disturbance that varies slowly accounts for these data as well"};
  if (const auto outdone = outdone_by_place(search, known, judged, effects))
    return OutdoneEffect{outdone->effect,
                         "a random force that belongs to the place accounts for these data as well",
                         outdone->was_average};
  return std::nullopt;
}

}  // namespace upright
