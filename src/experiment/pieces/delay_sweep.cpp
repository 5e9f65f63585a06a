#include "delay_sweep.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace upright::pieces {

namespace {

constexpr double finest_bisection_s = 1e-5;  // a fraction of the shortest period

enum Severity { stable, oscillating, fell };

Severity severity(const TrialResult& result) {
  return result.outcome == "fell" ? fell : result.outcome == "oscillating" ? oscillating : stable;
}

bool same_delay(double a, double b) {
  return std::abs(a - b) < 1e-12;
}

/// The next delay of the file's list: in order, up to the first fall.
std::optional<double> next_listed(const DelaySweep& sweep, const std::vector<TrialResult>& results) {
  for (const double delay : sweep.delays_s) {
    const auto at = std::find_if(results.begin(), results.end(),
                                 [&](const TrialResult& r) { return same_delay(r.trial.delay_s, delay); });
    if (at == results.end()) return delay;
    if (severity(*at) == fell) return std::nullopt;
  }
  return std::nullopt;
}

/// The middle of the gap in which the outcome becomes `from` or worse, while it is wider than asked for.
std::optional<double> next_bisected(const DelaySweep& sweep, const std::vector<TrialResult>& results,
                                    Severity from) {
  if (sweep.bisect_to_s <= 0.0) return std::nullopt;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (severity(results[i]) < from) continue;
    if (i == 0) return std::nullopt;
    const double low = results[i - 1].trial.delay_s, high = results[i].trial.delay_s;
    if (high - low <= sweep.bisect_to_s * (1.0 + 1e-9)) return std::nullopt;
    return 0.5 * (low + high);
  }
  return std::nullopt;
}

double first_delay_s(const std::vector<TrialResult>& results, Severity from) {
  for (const TrialResult& r : results)
    if (severity(r) >= from) return r.trial.delay_s;
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

void DelaySweep::keys(PieceKeys& keys) {
  keys.growing("delay_s", delays_s, any_delay);
  keys.number("duration_s", duration_s, any_duration, required);
  keys.integer("repeats", repeats, 1, 100, 1);
  keys.number("bisect_to_s", bisect_to_s, Range::within(0.0, 1.0), 0.0);
  keys.check_min("bisect_to_s", bisect_to_s, finest_bisection_s, true,
                 "is " + exact_text(bisect_to_s) + ", which is too fine",
                 "set it to 0 or to at least " + exact_text(finest_bisection_s));
  keys.number("stable_below_rad", stable_below_rad, Range{0.0, 1.0, true}, 0.0061);
  start_key(keys);
  keys.angle("theta0_deg", theta0_rad, release_deg, usual_release_deg);
  patience_key(keys);
}

std::optional<ExperimentTrial> DelaySweep::next_trial(std::size_t index,
                                                      const std::vector<TrialResult>& done) const {
  // All repeats of a delay before the next one.
  std::optional<ExperimentTrial> first;
  for (int repeat = 0; repeat < repeats; ++repeat)
    if (const auto delay = next_listed(*this, of_repeat(done, index, repeat));
        delay && (!first || *delay < first->delay_s))
      first = ExperimentTrial{index, repeat, *delay, 0};
  if (first) return first;
  for (const Severity from : {oscillating, fell})
    for (int repeat = 0; repeat < repeats; ++repeat)
      if (const auto delay = next_bisected(*this, of_repeat(done, index, repeat), from))
        return ExperimentTrial{index, repeat, *delay, 0};
  return std::nullopt;
}

void DelaySweep::set_trial(const ExperimentTrial& trial) {
  Balancing::set_trial(trial);
  delays_s = {trial.delay_s};
}

std::string DelaySweep::suffix(const ExperimentTrial& trial) const {
  // Tenths of a microsecond: whole numbers sort and make no odd characters.
  const auto tenths = static_cast<long long>(std::llround(trial.delay_s * 1e7));
  char text[64];
  std::snprintf(text, sizeof text, "-%lld.%04lldms-%d", tenths / 10000, tenths % 10000, trial.repeat + 1);
  return text;
}

std::string DelaySweep::words(const ExperimentTrial& trial) const {
  char text[64];
  std::snprintf(text, sizeof text, ": delay %.3f ms, repeat %d", trial.delay_s * 1e3, trial.repeat + 1);
  return text;
}

bool DelaySweep::is_result(const std::string& outcome) const {
  return outcome == "stable" || outcome == "oscillating" || outcome == "fell";
}

const char* DelaySweep::outcome_of(bool has_fallen, bool whole, double theta_amplitude_rad) const {
  if (has_fallen) return "fell";
  if (!whole) return "";
  return theta_amplitude_rad < stable_below_rad ? "stable" : "oscillating";
}

std::vector<TrialResult> of_repeat(const std::vector<TrialResult>& done, std::size_t piece, int repeat) {
  std::vector<TrialResult> results;
  for (const TrialResult& r : done)
    if (r.trial.piece == piece && r.trial.repeat == repeat) results.push_back(r);
  std::sort(results.begin(), results.end(),
            [](const TrialResult& a, const TrialResult& b) { return a.trial.delay_s < b.trial.delay_s; });
  return results;
}

double oscillates_from_s(const std::vector<TrialResult>& results) {
  return first_delay_s(results, oscillating);
}

double falls_from_s(const std::vector<TrialResult>& results) {
  return first_delay_s(results, fell);
}

}  // namespace upright::pieces
