#include "unusual_disturbance.hpp"

#include <cmath>
#include <optional>
#include <sstream>
#include <string>

namespace upright {

namespace {

/// Over this time a white force is averaged, as the tests of the residual average short pulses.
constexpr double pulse_s = 0.1;

/// The random force or torque.
struct Disturbance {
  const char *name, *unit;
  double white, coloured;  ///< the white one as its mean over a pulse
  double limit;            ///< of both; 0: not known

  double size() const { return std::hypot(white, coloured); }
};

std::string too_large(const char* unit, double limit) {
  std::ostringstream text;
  text.precision(3);
  text << "; more than " << limit << ' ' << unit
       << " is no usual disturbance: something is missing, or the rig was disturbed";
  return text.str();
}

/// Empty for a disturbance that is usual.
std::optional<std::string> sentence_on(const Disturbance& d, double correlation_s) {
  const bool drifts = d.coloured > 0.0 && correlation_s >= longest_correlation_s;
  const bool large = d.limit > 0.0 && d.size() > d.limit;
  if (!large && !drifts) return std::nullopt;
  std::ostringstream text;
  text.precision(3);
  text << "a random " << d.name << " of " << (drifts ? d.coloured : d.size()) << ' ' << d.unit << " remains";
  if (drifts || d.coloured > d.white)
    text << ", with a correlation time of " << correlation_s << " s";
  else
    text << " on average over a tenth of a second";
  if (drifts)
    text << " or more: it drifts, so something is missing that changes slowly";
  else
    text << too_large(d.unit, d.limit);
  return text.str();
}

double limit_of_force_n(const DataRange& range, const PriorPolicy& prior) {
  return prior.max_random_share * range.motor_force_rms_n;
}

}  // namespace

bool find_unusual_disturbance(const Noise& fitted, const DataRange& range, const PriorPolicy& prior,
                              ResidualTests& tests) {
  if (tests.structured) return false;
  const Noise noise = low_frequency_equivalent(fitted, tests);
  const double over_pulse = 1.0 / std::sqrt(pulse_s);
  const Disturbance force{"force", "N", noise.force * over_pulse, noise.coloured_force_n,
                          limit_of_force_n(range, prior)};
  const Disturbance torque{"torque", "N m", noise.torque * over_pulse, noise.coloured_torque_nm,
                           usual_torque_nm(range, prior)};
  for (const Disturbance& disturbance : {force, torque})
    if (const auto sentence = sentence_on(disturbance, noise.correlation_s)) {
      tests.sentence = *sentence;
      tests.structured = true;
      return true;
    }
  return false;
}

void report_track_force(const TrackForce& left, const DataRange& range, const PriorPolicy& prior,
                        Diagnosis& diagnosis) {
  const double limit_n = limit_of_force_n(range, prior);
  const bool usual = !(limit_n > 0.0 && left.deviation_n > limit_n);
  if (usual || diagnosis.verdict == Verdict::unexplained) {
    diagnosis.notes.push_back(sentence_on(left));
  } else {
    diagnosis.verdict = Verdict::unexplained;
    diagnosis.residual = sentence_on(left) + too_large("N", limit_n);
  }
}

}  // namespace upright
