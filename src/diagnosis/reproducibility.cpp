#include "reproducibility.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>

#include "belief.hpp"
#include "estimation/held_out.hpp"
#include "tails.hpp"
#include "without_effect.hpp"

namespace upright {

namespace {

constexpr double without_limit = std::numeric_limits<double>::infinity();

/// A part of the data and the fit of all effects to it.
struct Part {
  FitData data;
  FitResult with;
};

/// What a part saves with an effect. Unknown: infinite.
struct PartEvidence {
  double evidence = without_limit, t_value = without_limit;
};

/// The noise stays: a part must not account for an effect by more noise.
FitOptions parameters_only() {
  FitOptions options;
  options.noise_rounds = 0;
  return options;
}

std::vector<Eigen::Index> places_of(std::size_t effect, const std::vector<FreeParameter>& free) {
  std::vector<Eigen::Index> places;
  for (std::size_t j = 0; j < free.size(); ++j)
    if (free[j].effect == effect) places.push_back(static_cast<Eigen::Index>(j));
  return places;
}

/// The priors of a fit, with what another part says of one effect in the place of its own.
GaussianPrior prior_from(const Part& other, std::size_t effect, const std::vector<FreeParameter>& free) {
  const auto n = static_cast<Eigen::Index>(free.size());
  GaussianPrior prior{Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)};
  for (Eigen::Index j = 0; j < n; ++j) {
    const FreeParameter& p = free[static_cast<std::size_t>(j)];
    prior.mean[j] = p.prior_mean;
    if (p.prior_sigma > 0.0) prior.information(j, j) = 1.0 / (p.prior_sigma * p.prior_sigma);
  }
  const std::vector<Eigen::Index> own = places_of(effect, free);
  Eigen::VectorXd mean(static_cast<Eigen::Index>(own.size())), min_sigma(mean.size());
  for (Eigen::Index i = 0; i < mean.size(); ++i) {
    const FreeParameter& p = free[static_cast<std::size_t>(own[static_cast<std::size_t>(i)])];
    mean[i] = other.with.point.plant.find(effect)->values[p.index];
    min_sigma[i] = 1e-6 * p.scale;
  }
  const GaussianPrior belief = belief_of(mean, other.with.covariance(own, own), min_sigma);
  prior.mean(own) = belief.mean;
  prior.information(own, own) = belief.information;
  return prior;
}

/// Minus twice the log likelihood of one sample.
double objective_of(const LinearStep& step, const Measurement& run, const Plant& plant) {
  const std::array<bool, 2> present = {run.has_cart(), run.has_theta() && plant.pendulum.has_value()};
  double sum = 0.0;
  for (std::size_t channel = 0; channel < 2; ++channel) {
    if (!present[channel]) continue;
    const double e = step.innovation[channel], variance = step.variance[channel];
    sum += step.weight[channel] * (e * e / variance + std::log(variance));
  }
  return sum;
}

/// The window of a segment over which `with` saves most.
ShownStretch best_window(const FitData& data, std::size_t s, const std::vector<LinearStep>& without,
                         const std::vector<LinearStep>& with, const Plant& plant, double window_s) {
  const Segment& segment = data.segments[s];
  const Measurement& run = (*data.runs)[segment.run];
  std::vector<double> saved(1, 0.0);
  for (std::size_t i = 0; i < std::min(with.size(), without.size()); ++i)
    saved.push_back(saved.back() + objective_of(without[i], run, plant) - objective_of(with[i], run, plant));
  ShownStretch best{segment.run, run.time_s[segment.first], run.time_s[segment.first], -without_limit};
  std::size_t first = 0;
  for (std::size_t i = 0; i + 1 < saved.size(); ++i) {
    const double to_s = run.time_s[segment.first + i];
    while (run.time_s[segment.first + first] < to_s - window_s) ++first;
    const double evidence = saved[i + 1] - saved[first];
    if (evidence > best.evidence) best = {segment.run, run.time_s[segment.first + first], to_s, evidence};
  }
  return best;
}

class Parts {
 public:
  Parts(const Search& search, const Hypothesis& h) : search_(search), free_(h.free), given_(search.given()) {
    const FitData all = search.data_of(h.train.point);
    const ExcitationPolicy& excitation = search.policy().excitation;
    for (const std::vector<std::size_t>& places : halves(all, excitation.arm_m, excitation.speed_window_s)) {
      if (places.empty()) continue;
      Part part{{all.runs, {}, all.bound}, {}};
      FitPoint point{h.train.point.plant, {}, h.train.point.noise};
      for (const std::size_t place : places) {
        part.data.segments.push_back(all.segments[place]);
        point.starts.push_back(h.train.point.starts[place]);
      }
      part.with = fit(part.data, point, free_, parameters_only());
      parts_.push_back(std::move(part));
    }
  }

  Reproduction of(std::size_t effect) const {
    Reproduction result;
    result.effect = effect;
    result.transferred_evidence = result.t_value = without_limit;
    result.shows_most.evidence = -without_limit;
    if (!is_removable(parts_.front().with.point.plant, effect, given_)) return result;
    std::size_t contradicts = 0;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const Part& part = parts_[i];
      const FitResult without =
          fit_without(part.data, part.with.point, effect, free_, given_, parameters_only());
      note_savings(parts_[i], without, result);
      if (parts_.size() < 2 || !is_excited(parts_[1 - i], effect)) continue;
      const PartEvidence saved = transferred(parts_[1 - i], parts_[i], effect, without);
      if (!(saved.t_value < result.t_value)) continue;
      result.transferred_evidence = saved.evidence;
      result.t_value = saved.t_value;
      contradicts = i;
    }
    if (parts_.size() == 2) result.where = where(result, contradicts);
    std::stable_sort(result.runs.begin(), result.runs.end(),
                     [](const RunEvidence& a, const RunEvidence& b) { return a.run < b.run; });
    return result;
  }

 private:
  bool is_excited(const Part& part, std::size_t effect) const {
    const std::vector<Eigen::Index> own = places_of(effect, free_);
    return !own.empty() && std::isfinite(part.with.objective) &&
           part.with.information(own.front(), own.front()) > 0.0;
  }

  /// What a part saves with what another says of an effect.
  PartEvidence transferred(const Part& from, const Part& to, std::size_t effect,
                           const FitResult& without) const {
    Plant plant = to.with.point.plant;
    plant.set(effect, from.with.point.plant.find(effect)->values);
    FitOptions options = parameters_only();
    options.joint_prior = prior_from(from, effect, free_);
    const FitResult with = fit(to.data, moved_to(to.with.point, plant), free_, options);
    return evidence_over(without, with, static_cast<double>(places_of(effect, free_).size()));
  }

  /// What is saved, the beliefs of the parameters included, and by how many standard errors that is more than
  /// nothing. The segments are independent witnesses. Of a right effect of so many parameters a part falls
  /// short by chance, with the variance of chi-square.
  static PartEvidence evidence_over(const FitResult& without, const FitResult& with, double parameters) {
    const auto n = static_cast<double>(with.segment_objective.size());
    if (!std::isfinite(with.objective) || n < 2.0) return {};
    const double saved = without.objective - with.objective;
    double by_data = 0.0, square = 0.0;
    for (std::size_t s = 0; s < with.segment_objective.size(); ++s) {
      const double of_segment = without.segment_objective[s] - with.segment_objective[s];
      by_data += of_segment;
      square += of_segment * of_segment;
    }
    const double variance = n / (n - 1.0) * (square - by_data * by_data / n);
    const double t = saved / std::sqrt(variance + 2.0 * parameters);
    return {saved, std::copysign(normal_deviate(t, n - 1.0), t)};
  }

  /// What each run of a part saves with what the part itself says, and where most.
  void note_savings(const Part& part, const FitResult& without, Reproduction& result) const {
    const auto steps_without = linearise(part.data, without.point);
    const auto steps_with = linearise(part.data, part.with.point);
    for (std::size_t s = 0; s < part.data.segments.size(); ++s) {
      const std::size_t run = part.data.segments[s].run;
      const double saved = without.segment_objective[s] - part.with.segment_objective[s];
      auto known = std::find_if(result.runs.begin(), result.runs.end(),
                                [&](const RunEvidence& of) { return of.run == run; });
      if (known == result.runs.end()) known = result.runs.insert(known, {run, 0.0});
      known->evidence += saved;
      const ShownStretch best = best_window(part.data, s, steps_without[s], steps_with[s],
                                            part.with.point.plant, search_.policy().location.shown_s);
      if (best.evidence > result.shows_most.evidence) result.shows_most = best;
    }
  }

  bool is_one_run() const {
    return parts_[0].data.segments.front().run == parts_[1].data.segments.front().run;
  }

  std::string name_of(const Part& part) const {
    const std::vector<Segment>& segments = part.data.segments;
    const std::vector<Measurement>& runs = *part.data.runs;
    if (is_one_run())
      return std::string("every second segment of ") + runs[segments.front().run].name +
             (&part == &parts_[0] ? "" : ", from the second on");
    std::ostringstream text;
    std::size_t last = runs.size();
    for (const Segment& segment : segments) {
      if (segment.run == last) continue;
      text << (last == runs.size() ? "" : ", ") << runs[segment.run].name;
      last = segment.run;
    }
    return text.str();
  }

  std::string where(const Reproduction& r, std::size_t contradicts) const {
    std::ostringstream text;
    text.precision(3);
    text << "what " << name_of(parts_[1 - contradicts]) << " says of it "
         << (r.transferred_evidence < 0.0 ? "makes " : "improves ") << name_of(parts_[contradicts])
         << (r.transferred_evidence < 0.0 ? " worse than without it" : "") << " (evidence "
         << r.transferred_evidence << ", t " << r.t_value << ")";
    return text.str();
  }

  const Search& search_;
  const std::vector<FreeParameter>& free_;
  const Plant& given_;
  std::vector<Part> parts_;
};

}  // namespace

std::vector<Reproduction> reproduce(const Search& search, const Hypothesis& h,
                                    const std::vector<std::size_t>& effects) {
  std::vector<Reproduction> results;
  if (effects.empty()) return results;
  const Parts parts(search, h);
  results.reserve(effects.size());
  for (const std::size_t effect : effects) results.push_back(parts.of(effect));
  return results;
}

double white_evidence(const Reproduction& reproduction) {
  double sum = 0.0;
  for (const RunEvidence& run : reproduction.runs) sum += run.evidence;
  return sum;
}

std::vector<std::size_t> doubtful_effects(const std::vector<Reproduction>& reproductions,
                                          const Search& search) {
  const SelectionPolicy& policy = search.policy();
  std::vector<std::size_t> doubtful;
  for (const Reproduction& r : reproductions) {
    const bool borne_out = std::isfinite(r.t_value) && r.t_value > policy.significance.noticeable_z;
    const bool certain = borne_out && white_evidence(r) > policy.acceptance.overwhelming_evidence;
    if (!certain && !search.is_nuisance(r.effect)) doubtful.push_back(r.effect);
  }
  return doubtful;
}

bool is_contradicted(const Reproduction& reproduction, const SignificancePolicy& policy) {
  return reproduction.t_value < -policy.noticeable_z;
}

}  // namespace upright
