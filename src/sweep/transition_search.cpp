#include "transition_search.hpp"

#include <algorithm>
#include <limits>

namespace upright {

namespace {

constexpr double nowhere = std::numeric_limits<double>::quiet_NaN();

/// Where the outcome of the grid's runs becomes `from` or worse.
TransitionBracket on_grid(Outcome from, double stable_below_rad, std::span<const SweepRun> grid) {
  const auto first = std::find_if(grid.begin(), grid.end(),
                                  [&](const SweepRun& run) { return run.outcome(stable_below_rad) >= from; });
  return {from, first - grid.begin() - 1, first - grid.begin()};
}

}  // namespace

double TransitionBracket::low_s(std::span<const double> delays) const {
  if (low_s_) return *low_s_;
  return low_ < 0 ? nowhere : delays[static_cast<std::size_t>(low_)];
}

double TransitionBracket::found_s(std::span<const double> delays) const {
  if (high_s_) return *high_s_;
  const auto high = static_cast<std::size_t>(high_);
  return high < delays.size() ? delays[high] : nowhere;
}

std::optional<double> TransitionBracket::wanted(std::span<const double> delays) const {
  if (on_list()) return delays[static_cast<std::size_t>((low_ + high_) / 2)];
  const double low = low_s(delays), high = found_s(delays);
  const bool open = high - low > transition_tolerance_s * (1.0 + 1e-9);  // false where an end is nowhere
  return open ? std::optional(0.5 * (low + high)) : std::nullopt;
}

void TransitionBracket::narrow(std::span<const double> delays, Outcome outcome) {
  const bool past = outcome >= from_;
  if (on_list())
    (past ? high_ : low_) = (low_ + high_) / 2;
  else
    (past ? high_s_ : low_s_) = wanted(delays);
}

StartSearch::StartSearch(const SweepConfig& config, double theta0_rad)
    : config_(&config),
      theta0_rad_(theta0_rad),
      brackets_{TransitionBracket(Outcome::oscillating, -1, std::ssize(config.delay_s)),
                TransitionBracket(Outcome::fell, -1, std::ssize(config.delay_s))} {}

StartSearch::StartSearch(const SweepConfig& config, std::span<const SweepRun> grid)
    : config_(&config),
      theta0_rad_(grid.front().start.theta0_rad),
      brackets_{on_grid(Outcome::oscillating, config.stable_below_rad, grid),
                on_grid(Outcome::fell, config.stable_below_rad, grid)} {}

StartSearch::StartSearch(const SweepConfig& config, std::span<const double, numbers> from)
    : config_(&config),
      theta0_rad_(from[0]),
      brackets_{TransitionBracket(Outcome::oscillating, static_cast<std::ptrdiff_t>(from[1]),
                                  static_cast<std::ptrdiff_t>(from[2])),
                TransitionBracket(Outcome::fell, static_cast<std::ptrdiff_t>(from[3]),
                                  static_cast<std::ptrdiff_t>(from[4]))} {}

std::array<double, StartSearch::numbers> StartSearch::as_numbers() const {
  const auto oscillates = brackets_[0].range(), falls = brackets_[1].range();
  return {theta0_rad_, oscillates[0], oscillates[1], falls[0], falls[1]};
}

std::optional<LoopCase> StartSearch::next(bool on_list) {
  std::optional<double> delay_s;
  for (std::size_t b = 0; b < brackets_.size(); ++b) {
    if (asked_[b] || (on_list && !brackets_[b].on_list())) continue;
    const std::optional<double> wanted = brackets_[b].wanted(config_->delay_s);
    if (!wanted || (delay_s && *wanted != *delay_s)) continue;
    delay_s = wanted;  // one run for both brackets as long as they are the same
    asked_[b] = true;
  }
  return delay_s ? std::optional(LoopCase{theta0_rad_, *delay_s}) : std::nullopt;
}

void StartSearch::take(const SweepRun& run) {
  const Outcome outcome = run.outcome(config_->stable_below_rad);
  for (std::size_t b = 0; b < brackets_.size(); ++b) {
    if (!asked_[b] || brackets_[b].wanted(config_->delay_s) != run.start.delay_s) continue;
    brackets_[b].narrow(config_->delay_s, outcome);
    asked_[b] = false;
  }
}

std::size_t StartSearch::open() const {
  return static_cast<std::size_t>(std::count_if(
      brackets_.begin(), brackets_.end(),
      [this](const TransitionBracket& bracket) { return bracket.wanted(config_->delay_s).has_value(); }));
}

Transition StartSearch::transition() const {
  return {theta0_rad_, brackets_[0].found_s(config_->delay_s), brackets_[1].found_s(config_->delay_s)};
}

bool follow(std::vector<StartSearch> searches, std::span<const SweepRun> runs, std::span<StartSearch> ended) {
  std::size_t used = 0;
  for (StartSearch& search : searches)
    while (const std::optional<LoopCase> wanted = search.next()) {
      const auto run = std::find_if(runs.begin(), runs.end(), [&](const SweepRun& made) {
        return made.start.theta0_rad == wanted->theta0_rad && made.start.delay_s == wanted->delay_s;
      });
      if (run == runs.end()) return false;
      search.take(*run);
      ++used;
    }
  if (used != runs.size()) return false;
  std::copy(searches.begin(), searches.end(), ended.begin());
  return true;
}

}  // namespace upright
