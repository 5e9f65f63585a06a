// closed_loop: balance, with set-point steps; or controllers that take turns, from the same starts.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "experiment/pieces/balancing.hpp"

namespace upright::pieces {

class ClosedLoop final : public PieceOf<ClosedLoop, Balancing> {
 public:
  static constexpr const char* kind = "closed_loop";

  void keys(PieceKeys& keys) override {
    keys.list("set_points_m", set_points_m_, Range::within(-longest_travel_m, longest_travel_m));
    keys.number("hold_s", hold_s_, any_duration, required);
    keys.number("delay_s", delay_s_, any_delay, 0.0);
    keys.controllers("gains", controllers_);
    const bool take_turns = !controllers_.empty();
    if (take_turns) keys.integer("repeats", rounds_, 1, 100, 5);
    start_key(keys);
    if (take_turns)
      keys.angle_or_list("theta0_deg", theta0_rad, starts_rad_, release_deg, usual_release_deg);
    else
      keys.angle("theta0_deg", theta0_rad, release_deg, usual_release_deg);
    patience_key(keys);
  }
  void refuse_beyond(double travel_m, const YamlMap& map) const override {
    for (const double x : set_points_m_)
      if (std::abs(x) >= travel_m)
        map.fail("set_points_m", "contains " + exact_text(x) + ", which is beyond travel_m",
                 "move the set-points closer to the middle");
  }
  PieceTime time() const override { return {hold_s_ * static_cast<double>(set_points_m_.size()), "hold_s"}; }
  double runs() const override {
    return controllers_.empty() ? 1.0
                                : static_cast<double>(rounds_) * static_cast<double>(controllers_.size());
  }

  /// Round after round, each controller once.
  std::optional<ExperimentTrial> next_trial(std::size_t index,
                                            const std::vector<TrialResult>& done) const override {
    if (controllers_.empty()) return PieceKind::next_trial(index, done);
    for (int round = 0; round < rounds_; ++round)
      for (std::size_t controller = 0; controller < controllers_.size(); ++controller) {
        const bool is_done = std::any_of(done.begin(), done.end(), [&](const TrialResult& r) {
          return r.trial.piece == index && r.trial.repeat == round && r.trial.controller == controller;
        });
        if (!is_done) return ExperimentTrial{index, round, delay_s_, controller};
      }
    return std::nullopt;
  }
  /// Every controller from every start.
  std::vector<ExperimentTrial> rehearsals() const override {
    if (controllers_.empty()) return PieceKind::rehearsals();
    const int starts = std::max(1, static_cast<int>(starts_rad_.size()));
    std::vector<ExperimentTrial> trials;
    for (std::size_t controller = 0; controller < controllers_.size(); ++controller)
      for (int round = 0; round < std::min(rounds_, starts); ++round)
        trials.push_back({0, round, delay_s_, controller});
    return trials;
  }
  void set_trial(const ExperimentTrial& trial) override {
    Balancing::set_trial(trial);
    if (controllers_.empty()) return;
    if (!starts_rad_.empty())
      theta0_rad = starts_rad_[static_cast<std::size_t>(trial.repeat) % starts_rad_.size()];
    controllers_.clear();
    starts_rad_.clear();
    rounds_ = 1;
  }
  std::string suffix(const ExperimentTrial& trial) const override {
    if (controllers_.empty()) return "";
    return "-" + controllers_[trial.controller].name + "-" + std::to_string(trial.repeat + 1);
  }
  std::string words(const ExperimentTrial& trial) const override {
    if (controllers_.empty()) return "";
    return ": " + controllers_[trial.controller].name + ", round " + std::to_string(trial.repeat + 1) +
           " of " + std::to_string(rounds_);
  }

  double reference_m(double acted_s) const noexcept override {
    const auto at = static_cast<std::size_t>(acted_s / hold_s_);
    return set_points_m_[std::min(at, set_points_m_.size() - 1)];
  }
  /// In a comparison a fall is a result.
  const char* outcome_of(bool fell, bool whole, double) const override {
    return fell && !controllers_.empty() ? "fell" : whole ? "done" : "";
  }
  std::span<const NamedGains> controllers() const override { return controllers_; }

  std::vector<Stretch> stretches(const ScriptContext&) const override {
    return {{0.0, 0.0, hold_s_ * static_cast<double>(set_points_m_.size())}};
  }

 private:
  std::vector<double> set_points_m_;
  double hold_s_ = 0.0;
  std::vector<NamedGains> controllers_;
  std::vector<double> starts_rad_;  ///< the same for one round after another; empty: theta0_rad in each
  int rounds_ = 1;                  ///< of the controllers
};

}  // namespace upright::pieces
