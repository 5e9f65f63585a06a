#include "final_fits.hpp"

#include <algorithm>
#include <tuple>

#include "periodic_starts.hpp"
#include "phases.hpp"
#include "plausibility.hpp"
#include "thinned_record.hpp"

namespace upright {

FinalFits::FinalFits(Search& search, const StepwiseSelection& selection,
                     const std::vector<Measurement>* all_samples, const DiagnosisOptions& options)
    : search_(search),
      selection_(selection),
      all_samples_(all_samples),
      options_(options),
      policy_(search.policy()) {}

void FinalFits::settle(const std::set<std::size_t>& withdrawn) {
  const Hypothesis& h = selection_.current();
  const auto n = static_cast<Eigen::Index>(h.free.size());
  ParameterPosterior posterior{Eigen::VectorXd(n), Eigen::VectorXd(n), h.train.covariance};
  std::vector<bool> is_correction;
  for (const FreeParameter& p : h.free) {
    const auto at = static_cast<Eigen::Index>(is_correction.size());
    posterior.value[at] = h.train.point.plant.find(p.effect)->values[p.index];
    posterior.prior_mean[at] = p.prior_mean;
    is_correction.push_back(std::find(selection_.found().begin(), selection_.found().end(), p.effect) ==
                            selection_.found().end());
  }
  std::vector<std::size_t> corrections;
  for (const std::size_t j : certain_parameters(posterior, is_correction, policy_.significance))
    if (is_correction[j] && !keeps_prior(h, j) && !withdrawn.contains(h.free[j].effect) &&
        search_.is_plausible(h, h.free[j].effect) &&
        std::find(corrections.begin(), corrections.end(), h.free[j].effect) == corrections.end())
      corrections.push_back(h.free[j].effect);
  fit_last(corrections);
  order_corrections(corrections);
}

void FinalFits::fit_last(std::vector<std::size_t>& corrections) {
  const Hypothesis* from = &selection_.current();
  for (;;) {
    options_.report_progress(0.88, "final fit to the training runs");
    std::vector<std::size_t> all = selection_.found();
    all.insert(all.end(), corrections.begin(), corrections.end());
    judged_ = search_.fitted_separately(all, *from, nullptr, true);
    search_.filter_held_out(judged_, judged_.train.point.noise);
    from = &judged_;
    options_.report_progress(0.9, "final fit to all runs");
    known_ = search_.fitted_to_all_runs(judged_);
    const auto includes_nothing = [&](std::size_t effect) {
      return !is_certain_of_all_runs(search_.certainty(known_, effect), policy_.significance);
    };
    const auto gone = std::remove_if(corrections.begin(), corrections.end(), includes_nothing);
    if (gone == corrections.end()) return;
    corrections.erase(gone, corrections.end());
  }
}

bool FinalFits::keeps_prior(const Hypothesis& h, std::size_t j) const {
  const FreeParameter& p = h.free[j];
  if (effect_registry()[p.effect].enters == Enters::parameter || search_.given().find(p.effect) == nullptr)
    return false;
  const double value = h.train.point.plant.find(p.effect)->values[p.index];
  return is_within_prior(value, p.prior_mean, p.prior_sigma, policy_.significance);
}

void FinalFits::order_corrections(const std::vector<std::size_t>& corrections) {
  const Noise noise = judged_.train.point.noise;
  std::vector<std::tuple<bool, double, std::size_t>> ranked;
  for (const std::size_t effect : corrections) {
    std::vector<std::size_t> others = selection_.found();
    for (const std::size_t other : corrections)
      if (other != effect) others.push_back(other);
    Hypothesis h = search_.fitted_separately(others, judged_, &noise);
    search_.filter_held_out(h, noise);
    ranked.emplace_back(effect_registry()[effect].enters == Enters::parameter, -search_.gap_of(h), effect);
  }
  std::sort(ranked.begin(), ranked.end());
  corrections_.clear();
  for (const auto& [number, gap, effect] : ranked) corrections_.push_back(effect);
}

void FinalFits::fit_all_samples() {
  options_.report_progress(0.94, "fitting all samples");
  const FitData data = search_.data_of(known_.train.point);
  reported_ = all_samples_ == nullptr ? known_ : fitted_to_all_samples(known_, data, *all_samples_);
  reported_.train.covariance += search_.covariance_from_held_numbers(data, known_);
}

std::optional<Withdrawal> FinalFits::uncertain_effect() const {
  if (const auto open = effect_with_open_size())
    return Withdrawal{*open, "its size is not certain once all samples are fitted"};
  if (const auto open = effect_with_open_phase())
    return Withdrawal{
        *open, "its phase at the zero of the cart is open, so its force is known only where it was measured"};
  if (const auto open = effect_with_open_pitch())
    return Withdrawal{
        *open, "its pitch may be as long as a third of the travel, so the data do not show that it repeats"};
  return std::nullopt;
}

std::optional<std::size_t> FinalFits::effect_with_open_size() const {
  const auto certainty_of = [&](std::size_t effect) {
    const bool is_new = search_.given().find(effect) == nullptr;
    return is_new && !search_.is_plausible(reported_, effect) ? 0.0 : search_.certainty(reported_, effect);
  };
  std::optional<std::size_t> least;
  for (const std::size_t effect : effects()) {
    if (is_certain_of_all_runs(certainty_of(effect), policy_.significance)) continue;
    if (!least || certainty_of(effect) < certainty_of(*least)) least = effect;
  }
  return least;
}

std::optional<std::size_t> FinalFits::effect_with_open_phase() const {
  for (const std::size_t effect : effects())
    if (is_phase_open(estimates_of(effect, reported_))) return effect;
  return std::nullopt;
}

std::optional<std::size_t> FinalFits::effect_with_open_pitch() const {
  const double longest_m = longest_pitch_m(search_.range(), policy_.prior);
  for (const std::size_t effect : effects())
    if (search_.given().find(effect) == nullptr && is_pitch_open(estimates_of(effect, reported_), longest_m))
      return effect;
  return std::nullopt;
}

std::vector<std::size_t> FinalFits::effects() const {
  std::vector<std::size_t> all = selection_.found();
  all.insert(all.end(), corrections_.begin(), corrections_.end());
  return all;
}

}  // namespace upright
