#include "disturbance_null.hpp"

#include "coloured_null.hpp"
#include "place_null.hpp"

namespace upright {

std::optional<Withdrawal> outdone_by_disturbance(Search& search, const Hypothesis& known,
                                                 const Hypothesis& judged,
                                                 const std::vector<Reproduction>& effects) {
  if (const auto effect = outdone_by_coloured_noise(search, known, effects))
    return Withdrawal{*effect, "a disturbance that varies slowly accounts for these data as well"};
  return outdone_by_place(search, known, judged, effects);
}

}  // namespace upright
