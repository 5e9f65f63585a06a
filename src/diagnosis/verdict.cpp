#include "verdict.hpp"

#include <sstream>

#include "detectable.hpp"

namespace upright {

namespace {

/// Whether what was found closes more than it leaves of what the plant file as given has above the noise
/// floor.
bool closes_excess(const Diagnosis& diagnosis) {
  const double before = diagnosis.gap_before - 1.0, after = diagnosis.gap_after - 1.0;
  return after < before - after;
}

}  // namespace

Verdict verdict_of(const Diagnosis& diagnosis, const VerdictGrounds& grounds) {
  if (grounds.structured) return Verdict::unexplained;
  const bool found = !diagnosis.effects.empty();
  if (found || !diagnosis.numbers.empty()) {
    if (!grounds.clear_gap || closes_excess(diagnosis)) return Verdict::explained;
    if (found) return Verdict::unexplained;
  }
  if (!diagnosis.helps_here_only.empty()) return Verdict::unexplained;
  const bool shows_nothing = grounds.clear_gap || grounds.may_hide || !grounds.moves_enough;
  return shows_nothing ? Verdict::not_excited : Verdict::no_discrepancy;
}

std::string why_not_excited(const Diagnosis& diagnosis, const VerdictGrounds& grounds,
                            const std::vector<Detectable>& hidden) {
  std::ostringstream text;
  text.precision(2);
  if (grounds.clear_gap)
    text << "the fitted runs leave the numbers of the plant file so open that held-out data are "
         << diagnosis.gap_after << " times as far off as noise: record longer runs";
  const std::string could_hide = sentence_on_hidden(hidden);
  if (grounds.clear_gap && !could_hide.empty()) text << "; ";
  text << could_hide;
  return text.str();
}

}  // namespace upright
