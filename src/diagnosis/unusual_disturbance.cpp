#include "unusual_disturbance.hpp"

#include <optional>
#include <sstream>
#include <string>

namespace upright {

namespace {

/// The coloured force or torque.
struct Disturbance {
  const char *name, *unit;
  double size;
  double usual;  ///< size of an effect; 0: not known
};

/// Empty for a disturbance that is usual.
std::optional<std::string> sentence_on(const Disturbance& d, double correlation_s) {
  const bool large = d.usual > 0.0 && d.size > d.usual;
  const bool drifts = d.size > 0.0 && correlation_s >= longest_correlation_s;
  if (!large && !drifts) return std::nullopt;
  std::ostringstream text;
  text.precision(2);
  text << "a random " << d.name << " of " << d.size << ' ' << d.unit
       << " remains, with a correlation time of " << correlation_s << " s";
  if (drifts)
    text << " or more: it drifts, so something is missing that changes slowly";
  else
    text << "; more than " << d.usual << ' ' << d.unit
         << " is no usual disturbance: something is missing, or the rig was disturbed";
  return text.str();
}

}  // namespace

bool find_unusual_disturbance(const Noise& noise, const DataRange& range, const PriorPolicy& prior,
                              ResidualTests& tests) {
  if (tests.structured) return false;
  const Disturbance force{"force", "N", noise.coloured_force_n, usual_force_n(range, prior)};
  const Disturbance torque{"torque", "N m", noise.coloured_torque_nm, usual_torque_nm(range, prior)};
  for (const Disturbance& disturbance : {force, torque})
    if (const auto sentence = sentence_on(disturbance, noise.correlation_s)) {
      tests.sentence = *sentence;
      tests.structured = true;
      return true;
    }
  return false;
}

}  // namespace upright
