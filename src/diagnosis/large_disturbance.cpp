#include "large_disturbance.hpp"

#include <sstream>
#include <string>

namespace upright {

namespace {

std::string sentence_on(const char* name, const char* unit, double size, double usual, double time_s) {
  std::ostringstream text;
  text.precision(2);
  text << "a random " << name << " of " << size << ' ' << unit << " remains, with a correlation time of "
       << time_s << " s; more than " << usual << ' ' << unit
       << " is no usual disturbance: something is missing, or the rig was disturbed";
  return text.str();
}

}  // namespace

bool find_large_disturbance(const Noise& noise, const DataRange& range, const PriorPolicy& prior,
                            ResidualTests& tests) {
  if (tests.structured) return false;
  const double force_n = usual_force_n(range, prior), torque_nm = usual_torque_nm(range, prior);
  if (noise.coloured_force_n > force_n && force_n > 0.0) {
    tests.sentence = sentence_on("force", "N", noise.coloured_force_n, force_n, noise.correlation_s);
    tests.structured = true;
  } else if (noise.coloured_torque_nm > torque_nm && torque_nm > 0.0) {
    tests.sentence = sentence_on("torque", "N m", noise.coloured_torque_nm, torque_nm, noise.correlation_s);
    tests.structured = true;
  }
  return tests.structured;
}

}  // namespace upright
