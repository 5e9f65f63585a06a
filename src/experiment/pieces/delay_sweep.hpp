// delay_sweep: balance under one delay after another. Delays grow, so that falls come late; what lies between
// two outcomes is bisected, the fall last.
#pragma once

#include <string>
#include <vector>

#include "experiment/pieces/balancing.hpp"

namespace upright::pieces {

class DelaySweep final : public PieceOf<DelaySweep, Balancing> {
 public:
  static constexpr const char* kind = "delay_sweep";

  void keys(PieceKeys& keys) override;
  PieceTime time() const override { return {duration_s}; }
  double runs() const override { return static_cast<double>(repeats) * static_cast<double>(delays_s.size()); }

  std::optional<ExperimentTrial> next_trial(std::size_t index,
                                            const std::vector<TrialResult>& done) const override;
  void set_trial(const ExperimentTrial& trial) override;
  std::string suffix(const ExperimentTrial& trial) const override;
  std::string words(const ExperimentTrial& trial) const override;
  bool is_result(const std::string& outcome) const override;
  const char* outcome_of(bool fell, bool whole, double theta_amplitude_rad) const override;

  std::vector<Stretch> stretches(const ScriptContext&) const override { return {{0.0, 0.0, duration_s}}; }

  std::vector<double> delays_s;  ///< increasing
  double duration_s = 0.0;       ///< of a run
  int repeats = 1;
  double bisect_to_s = 0.0;  ///< 0: transitions are not bisected
  double stable_below_rad = 0.0;
};

/// The results of one repeat of a sweep, by delay.
std::vector<TrialResult> of_repeat(const std::vector<TrialResult>& done, std::size_t piece, int repeat);

/// The shortest delay of one repeat from which on the pendulum oscillates or falls, or falls; not a number
/// where there is none.
double oscillates_from_s(const std::vector<TrialResult>& results);
double falls_from_s(const std::vector<TrialResult>& results);

}  // namespace upright::pieces
