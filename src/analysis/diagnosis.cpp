#include "upright/analysis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <sstream>

#include "upright/analysis/confusable.hpp"
#include "upright/analysis/next_experiment.hpp"
#include "upright/analysis/noise_floor.hpp"
#include "upright/analysis/residual.hpp"
#include "upright/analysis/search.hpp"
#include "upright/analysis/structure.hpp"
#include "upright/model/error.hpp"

namespace upright {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Minus twice the log likelihood that an effect must save on the training data before it is believed. About
/// 30 candidates with up to three parameters are tried; 25 keeps chance below one in a thousand when noise is
/// white.
constexpr double least_evidence = 25.0;
/// The same as a t value of the saving per quarter of a second, which stays honest where the noise is not
/// white.
constexpr double least_t = 3.0;
/// Evidence so large that coloured noise cannot have made it, however few the segments are that hold it.
constexpr double overwhelming_evidence = 1000.0;
/// And its size must be this many of its robust standard errors from nothing.
constexpr double least_certainty = 4.0;
/// What each parameter beyond the first must save on top: a simpler effect that does nearly as well is
/// preferred.
constexpr double parameter_price = 10.0;
/// Two explanations whose evidence differs by less than this, or by less than its own scatter, are not told
/// apart.
constexpr double confusable_evidence = 16.0;
/// However much it scatters, by this at most.
constexpr double most_scattered = 10.0 * confusable_evidence;
/// A correction of the plant file is there when it is this many standard errors from nothing.
constexpr double least_correction_z = 4.0;
/// What is left goes with something when it does so by this many standard errors: of the dozen dependences
/// that are tried, chance makes one in two hundred times.
constexpr double least_dependence = 3.5;
/// Kurtosis of the pulses of a disturbance that does not come in bursts. A Gaussian's is 3.
constexpr double heaviest_tails = 5.5;
/// A plain simulation may be this many times as far off as noise like what is left makes it at most.
constexpr double most_excess = 2.0;
/// What is left may push this many times as hard over a tenth of a second and more as white noise that
/// accounts for single samples. A disturbance of 10 Hz makes it 1.8 here at most (measured on the matrix),
/// forces that go with the motion more.
constexpr double slowest = 2.5;
constexpr int most_rounds = 4;
constexpr std::size_t finalists = 4;
/// What gains this share of what the best does may be the same thing by another name, or half of it.
constexpr double resembles = 0.3;
constexpr std::size_t most_resembling = 8;

std::string kind_of(std::size_t effect) {
  return std::string(effect_registry()[effect].kind);
}

/// How lively a stretch is: root mean square speed of the cart, or of the pendulum where the cart does not
/// move.
double liveliness(const Measurement& run, const Segment& stretch) {
  const std::vector<double>& position = run.has_cart() && !run.cart_locked ? run.cart_m : run.theta_rad;
  const auto stride = std::max<std::size_t>(1, static_cast<std::size_t>(0.02 / run.median_period_s()));
  double sum = 0.0, count = 0.0;
  for (std::size_t k = stretch.first + stride; k <= stretch.last; k += stride) {
    const double speed = (position[k] - position[k - stride]) / (run.time_s[k] - run.time_s[k - stride]);
    sum += speed * speed;
    count += 1.0;
  }
  return std::sqrt(sum / std::max(count, 1.0));
}

/// Which stretches to hold out, a third of them: the middle one of each three in the order of how lively they
/// are, so that the fit need not answer for motions beyond those it saw, in whatever order they come.
std::vector<std::size_t> choose_held_out(const std::vector<Measurement>& runs,
                                         const std::vector<Segment>& stretches) {
  std::vector<double> lively;
  lively.reserve(stretches.size());
  for (const Segment& stretch : stretches) lively.push_back(liveliness(runs[stretch.run], stretch));
  std::vector<std::size_t> order(stretches.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return lively[a] < lively[b]; });
  std::vector<std::size_t> held;
  if (order.size() == 2) held = {order[0]};
  for (std::size_t i = 1; i < order.size() && order.size() > 2; i += 3) held.push_back(order[i]);
  std::sort(held.begin(), held.end());
  return held;
}

/// Holds out whole runs; of one run, segments of it.
void split(const std::vector<Measurement>& runs, Diagnosis& diagnosis, FitData& train, FitData& held) {
  const std::vector<Segment> segments = cut_segments(runs);
  train.runs = held.runs = &runs;
  std::vector<Segment> whole;
  whole.reserve(runs.size());
  for (std::size_t r = 0; r < runs.size(); ++r) whole.push_back({r, 0, runs[r].size() - 1});
  const bool one_run = runs.size() == 1;
  const std::vector<std::size_t> chosen = choose_held_out(runs, one_run ? segments : whole);
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const bool out = std::binary_search(chosen.begin(), chosen.end(), one_run ? s : segments[s].run);
    (out ? held : train).segments.push_back(segments[s]);
  }
  if (one_run) {
    diagnosis.notes.push_back("one run only: a third of its segments is held out");
  } else {
    diagnosis.held_out_runs = chosen;
  }
  if (held.segments.empty() && train.segments.size() > 1) {
    held.segments.push_back(train.segments.back());
    train.segments.pop_back();
  }
}

/// What a hypothesis says about one effect, as numbers with intervals.
std::vector<ParameterEstimate> estimates_of(std::size_t effect, const Hypothesis& h) {
  std::vector<ParameterEstimate> result;
  const EffectInfo& info = effect_registry()[effect];
  for (std::size_t i = 0; i < info.parameters.size(); ++i) {
    ParameterEstimate e;
    e.name = info.parameters[i].name;
    e.unit = info.parameters[i].unit;
    e.value = h.train.point.plant.find(effect)->values[i];
    e.low = e.high = e.value;
    for (std::size_t j = 0; j < h.free.size(); ++j) {
      if (h.free[j].effect != effect || h.free[j].index != i) continue;
      const auto at = static_cast<Eigen::Index>(j);
      const double sigma = std::sqrt(std::max(h.train.covariance(at, at), 0.0));
      e.low = e.value - 1.96 * sigma;
      e.high = e.value + 1.96 * sigma;
    }
    result.push_back(e);
  }
  return result;
}

class Diagnostician {
 public:
  Diagnostician(const Plant& plant, const std::vector<Measurement>& runs, const DiagnosisOptions& options)
      : plant_(plant), runs_(runs), options_(options) {
    split(runs_, result_, train_, held_);
    if (train_.segments.empty())
      throw ConfigError("record longer runs: no stretch of the data is long enough to simulate");
    search_.emplace(plant_, runs_, train_, held_);
  }

  Diagnosis run() {
    tell(0.02, "comparing the model as given");
    given_ = search_->baseline();
    if (!std::isfinite(given_.train.objective))
      throw ConfigError("check the plant file: the model cannot be simulated with these runs");
    current_ = given_;
    grow(0, most_rounds, false);
    try_pairs(finalists_);
    ResidualStructure left = settle();
    if (left.structured && try_pairs(resembling_)) left = settle();
    if (left.structured && grow(most_rounds, 2 * most_rounds, true)) left = settle();
    conclude(left);
    return std::move(result_);
  }

 private:
  void tell(double done, const std::string& what) {
    if (options_.progress) options_.progress(done, what);
  }

  std::vector<std::size_t> open_candidates() const {
    std::vector<std::size_t> candidates = candidate_effects(current_.train.point.plant, search_->range());
    for (const std::size_t effect : search_->nuisances())
      if (!current_.added.contains(effect)) candidates.push_back(effect);
    return candidates;
  }

  /// Those that promise a share of what the best one does, some at least, and all that cannot promise. A
  /// promise is kept within a factor of a few (measured on the matrix), so that the best is among them.
  std::vector<std::size_t> promising(const Hypothesis& from, const std::vector<std::size_t>& candidates,
                                     int round) {
    constexpr double share = 0.1;
    constexpr std::size_t least_count = 8;
    const std::vector<double> promised = search_->promised_gains(from, candidates);
    std::vector<std::size_t> ranking(candidates.size());
    std::iota(ranking.begin(), ranking.end(), std::size_t{0});
    std::stable_sort(ranking.begin(), ranking.end(),
                     [&](std::size_t a, std::size_t b) { return promised[a] > promised[b]; });
    double best = 0.0;
    for (const double gain : promised)
      if (std::isfinite(gain)) best = std::max(best, gain);
    std::vector<std::size_t> chosen;
    std::size_t kept = 0;
    for (const std::size_t i : ranking) {
      const bool unknown = !std::isfinite(promised[i]);
      if (unknown || kept < least_count || promised[i] > share * best) {
        chosen.push_back(candidates[i]);
        kept += unknown ? 0 : 1;
      } else if (round == 0) {
        result_.candidates.push_back({candidates[i], 0.0, std::max(promised[i], 0.0)});
      }
    }
    return chosen;
  }

  /// A hypothesis in which the new effect does nothing, or is of a size that makes it another effect, has
  /// lost.
  bool is_plausible(const Hypothesis& h, std::size_t effect) const {
    for (const FreeParameter& p : h.free) {
      if (p.effect != effect) continue;
      const double value = h.train.point.plant.find(effect)->values[p.index];
      if (p.index == 0 && value == effect_registry()[effect].parameters[0].neutral) return false;
      if (kind_of(effect).starts_with("angle_offset") &&
          std::abs(value) < 1.5 * search_->range().theta_resolution_rad)
        return false;
    }
    return true;
  }

  /// How many standard errors the size of an effect is from nothing: from what the plant file says, of a
  /// correction. Its other parameters (a shape, a place) are held: without a size they mean nothing.
  double certainty(const Hypothesis& h, std::size_t effect) const {
    std::vector<Eigen::Index> own;
    for (std::size_t j = 0; j < h.free.size(); ++j)
      if (h.free[j].effect == effect) own.push_back(static_cast<Eigen::Index>(j));
    if (own.empty() || h.free[static_cast<std::size_t>(own.front())].index != 0) return 0.0;
    const PlantEffect* given = plant_.find(effect);
    const double nothing =
        given != nullptr ? given->values[0] : effect_registry()[effect].parameters[0].neutral;
    if (!std::isfinite(nothing)) return infinity;
    const Eigen::MatrixXd covariance = h.train.covariance(own, own);
    const Eigen::VectorXd scale = covariance.diagonal().cwiseMax(1e-300).cwiseSqrt();
    const Eigen::MatrixXd correlation =
        scale.cwiseInverse().asDiagonal() * covariance * scale.cwiseInverse().asDiagonal();
    const double held = correlation.completeOrthogonalDecomposition().pseudoInverse()(0, 0);
    return std::abs(h.train.point.plant.find(effect)->values[0] - nothing) / scale[0] *
           std::sqrt(std::max(held, 1.0));
  }

  /// Evidence on the training runs that only something missing can hold against: held-out runs may excite
  /// what is missing still, and speak against a right effect until it is found too.
  static bool is_overwhelming(const Improvement& improvement, std::size_t effect) {
    return improvement.train - price_of(effect) > overwhelming_evidence && improvement.t_value > least_t;
  }

  /// What held-out runs spoke against while more was missing must have them on its side in the end, or all
  /// that was added since goes.
  void end_doubt() {
    if (!standing_) return;
    Hypothesis grown = std::move(current_);
    current_ = std::move(standing_->hypothesis);
    if (compare(current_, grown).held > 0.0 && simulates_as_well(grown)) {
      current_ = std::move(grown);
    } else {
      found_ = std::move(standing_->found);
      record_step();
    }
    standing_.reset();
  }

  /// Whether the size of an effect is certain. A fit that is less certain than its evidence says has not
  /// arrived: it goes on first.
  bool is_certain(Hypothesis& h, std::size_t effect) {
    const double so_far = certainty(h, effect);
    if (so_far >= least_certainty) return true;
    constexpr double of_noise_not_white = 4.0;
    if (compare(current_, h).train < of_noise_not_white * std::max(so_far * so_far, 1.0)) return false;
    Hypothesis further = h;
    search_->refine(h, further);
    if (further.train.objective < h.train.objective) h = std::move(further);
    return certainty(h, effect) >= least_certainty;
  }

  /// Gives the simpler hypothesis the richer one's noise to start from, so that a better estimate of the
  /// noise is not taken for an effect. What `current_` becomes is at least as good as before.
  void level_noise(const Hypothesis& richer) {
    Hypothesis again = current_;
    again.train.point.noise = richer.train.point.noise;
    search_->refine(again, again);
    if (again.train.objective < current_.train.objective) current_ = std::move(again);
  }

  static double price_of(std::size_t effect) {
    return parameter_price * static_cast<double>(effect_registry()[effect].parameters.size() - 1);
  }

  static bool is_believed(const Improvement& improvement, std::size_t effect) {
    const double evidence = improvement.train - price_of(effect);
    // Held-out data that do not excite the effect say nothing: odds of less than 2 to 1 against it.
    constexpr double indifferent = 1.4;
    if (evidence < least_evidence || !(improvement.held > -indifferent)) return false;
    return improvement.t_value > least_t || evidence > overwhelming_evidence;
  }

  const PlainSimulation& simulation(Hypothesis& h) const {
    if (!h.simulation) {
      Hypothesis plain = h;
      search_->judge(plain, sensor_noise(h));
      const FitResult& simulated = held_.segments.empty() ? plain.train : plain.held;
      h.simulation.emplace(PlainSimulation{gap_of(plain), {}});
      for (std::size_t s = 0; s < simulated.segment_chi_square.size(); ++s)
        h.simulation->segment_gap.push_back(
            std::sqrt(simulated.segment_chi_square[s] / std::max(simulated.segment_samples[s], 1e-9)));
    }
    return *h.simulation;
  }
  double simulation_gap(Hypothesis& h) const { return simulation(h).gap; }

  /// Forces that look right a sample ahead can simulate badly: then the name is wrong. By how much segments
  /// are further off, as far as their number can show it: while more is missing, one and the other come out
  /// better or worse by half.
  bool simulates_as_well(Hypothesis& h) {
    if (held_.segments.empty()) return true;
    const std::vector<double>& now = simulation(h).segment_gap;
    const std::vector<double>& before = simulation(current_).segment_gap;
    const auto n = static_cast<double>(now.size());
    double mean = 0.0, square = 0.0;
    for (std::size_t s = 0; s < now.size(); ++s) {
      const double worse = std::log(std::max(now[s], 1e-9) / std::max(before[s], 1e-9));
      mean += worse / n;
      square += worse * worse / n;
    }
    constexpr double by_chance = 0.1, least_scatter = 0.5;
    const double scatter = std::max(least_scatter, std::sqrt(std::max(square - mean * mean, 0.0)));
    return mean < by_chance + scatter / std::sqrt(n);
  }

  /// Where a hypothesis and the data disagree most: in which equation, with what it goes, and when.
  std::string locate(const Hypothesis& h) const {
    const ResidualPlace place = locate_residual(train_, h.train.point);
    std::size_t worst = 0;
    double largest = 0.0;
    for (std::size_t s = 0; s < h.train.segment_chi_square.size(); ++s) {
      const double mean = h.train.segment_chi_square[s] / std::max(h.train.segment_samples[s], 1.0);
      if (mean <= largest) continue;
      largest = mean;
      worst = s;
    }
    const Segment& segment = train_.segments[worst];
    const Measurement& run = runs_[segment.run];
    std::ostringstream text;
    text.precision(3);
    text << "in the " << (place.in_pendulum ? "pendulum" : "cart") << " equation: the residual "
         << (place.in_pendulum ? "torque" : "force") << " goes with " << place.goes_with << " ("
         << std::lround(100.0 * place.share) << " percent of it can be predicted); the worst stretch is "
         << run.name << " from " << run.time_s[segment.first] << " to " << run.time_s[segment.last] << " s";
    return text.str();
  }

  void record_trial(int round, std::size_t effect, const Hypothesis& h, const Improvement& improvement) {
    Trial trial;
    trial.round = static_cast<std::size_t>(round);
    trial.effect = effect;
    trial.evidence = improvement.train;
    trial.held = improvement.held;
    trial.t_value = improvement.t_value;
    trial.certainty = certainty(h, effect);
    trial.noise = h.train.point.noise;
    if (std::isfinite(h.train.objective)) trial.parameters = estimates_of(effect, h);
    result_.trials.push_back(trial);
  }

  /// What was found before an effect was added that held-out runs spoke against.
  struct Standing {
    Hypothesis hypothesis;
    std::vector<std::size_t> found;
  };

  /// An effect that might be added, and what it saves beyond its price.
  struct Believed {
    std::size_t effect = 0;
    Hypothesis hypothesis;
    double score = 0.0;
  };

  /// The one with the largest score. Close ones are fitted to the end first, for a fit that stopped a little
  /// early is no reason; scores that are equal then leave it to the plainer effect.
  std::size_t choose(std::vector<Believed>& believed) {
    constexpr double close = 0.05, equal = 4.0;
    const auto largest = [&] {
      double score = -infinity;
      for (const Believed& b : believed) score = std::max(score, b.score);
      return score;
    };
    const double to_reach = (1.0 - close) * largest();
    if (std::count_if(believed.begin(), believed.end(),
                      [&](const Believed& b) { return b.score > to_reach; }) > 1)
      for (Believed& b : believed) {
        if (b.score <= to_reach) continue;
        tell(0.8, "fitting " + kind_of(b.effect) + " to the end");
        Hypothesis further = b.hypothesis;
        search_->refine(b.hypothesis, further);
        const double gain = b.hypothesis.train.objective - further.train.objective;
        if (!(gain > 0.0)) continue;
        b.hypothesis = std::move(further);
        b.score += gain;
      }
    const double best = largest();
    std::size_t chosen = believed.size();
    for (std::size_t i = 0; i < believed.size(); ++i)
      if (believed[i].score > best - equal &&
          (chosen == believed.size() || is_plainer(believed[i].effect, believed[chosen].effect)))
        chosen = i;
    return chosen;
  }

  /// Adds effects one at a time, the best first, for as long as the data ask for one. `calmly`: as they show
  /// with little noise, for much noise can account for the whole of an effect. Whether one was added.
  bool grow(int first_round, int last_round, bool calmly) {
    const std::vector<std::size_t> before = found_;
    for (int round = first_round; round < last_round && add_best(round, calmly); ++round) {
    }
    end_doubt();
    return found_ != before;
  }

  /// One round: whether an effect was added.
  bool add_best(int round, bool calmly) {
    const double done = std::min(0.05 + 0.2 * round, 0.7);
    tell(done, "looking for what is missing");
    Hypothesis from = current_;
    if (calmly) from.train.point.noise = calmed(from.train.point.noise);
    const std::vector<std::size_t> candidates = promising(from, open_candidates(), round);
    std::vector<std::pair<double, Hypothesis>> screened;
    const double sieved = search_->sieved(from).train.objective;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      tell(done + 0.02 + 0.1 * static_cast<double>(c) / static_cast<double>(candidates.size()),
           "trying " + kind_of(candidates[c]));
      Hypothesis h = search_->screened(from, candidates[c]);
      const double gain = sieved - h.train.objective - price_of(candidates[c]);
      if (round == 0) result_.candidates.push_back({candidates[c], 0.0, std::max(gain, 0.0)});
      screened.emplace_back(gain, std::move(h));
    }
    std::vector<std::size_t> ranking(candidates.size());
    for (std::size_t i = 0; i < ranking.size(); ++i) ranking[i] = i;
    std::stable_sort(ranking.begin(), ranking.end(),
                     [&](std::size_t a, std::size_t b) { return screened[a].first > screened[b].first; });
    if (round == 0)
      for (const std::size_t i : ranking)
        if (resembling_.size() < most_resembling &&
            screened[i].first > resembles * screened[ranking[0]].first)
          resembling_.emplace_back(candidates[i], screened[i].second);
    std::vector<Believed> believed, doubtful;
    constexpr double of_best = 0.05;  // what a whole fit does not make up for
    for (std::size_t place = 0; place < std::min(finalists, ranking.size()); ++place) {
      const std::size_t i = ranking[place];
      if (screened[i].first < std::max(0.4 * least_evidence, of_best * screened[ranking[0]].first)) break;
      tell(done + 0.12 + 0.08 * static_cast<double>(place) / finalists, "fitting " + kind_of(candidates[i]));
      Hypothesis h = screened[i].second;
      search_->refine(current_, h);
      if (round == 0) simulation_gap(h);
      if (round == 0) finalists_.emplace_back(candidates[i], h);
      Improvement improvement = compare(current_, h);
      record_trial(round, candidates[i], h, improvement);
      if (!is_plausible(h, candidates[i])) continue;
      if (!is_believed(improvement, candidates[i])) {
        if (is_overwhelming(improvement, candidates[i]) && is_certain(h, candidates[i]))
          doubtful.push_back({candidates[i], h, improvement.train - price_of(candidates[i])});
        continue;
      }
      if (improvement.train < overwhelming_evidence) {
        level_noise(h);
        improvement = compare(current_, h);
        if (!is_believed(improvement, candidates[i])) continue;
      }
      const bool correction = current_.train.point.plant.find(candidates[i]) != nullptr;
      if (!correction && !is_certain(h, candidates[i])) continue;
      const double score = compare(current_, h).train - price_of(candidates[i]);
      if (simulates_as_well(h)) {
        believed.push_back({candidates[i], std::move(h), score});
      } else if (is_overwhelming(improvement, candidates[i])) {
        doubtful.push_back({candidates[i], std::move(h), score});
      }
    }
    if (believed.empty() && !doubtful.empty()) {
      if (!standing_) standing_.emplace(Standing{current_, found_});
      believed = std::move(doubtful);
    }
    if (believed.empty()) return false;
    Believed& best = believed[choose(believed)];
    const std::size_t best_effect = best.effect;
    for (Trial& trial : result_.trials)
      if (trial.round == static_cast<std::size_t>(round) && trial.effect == best_effect) trial.taken = true;
    where_[best_effect] = locate(current_);
    current_ = std::move(best.hypothesis);
    found_.push_back(best_effect);
    // What gained a fair share of the same may be the same thing by another name.
    std::vector<std::size_t>& near = near_[best_effect];
    const auto winner = std::find(candidates.begin(), candidates.end(), best_effect) - candidates.begin();
    const double winning = screened[static_cast<std::size_t>(winner)].first;
    for (std::size_t i = 0; i < candidates.size(); ++i)
      if (candidates[i] != best_effect && screened[i].first > resembles * winning)
        near.push_back(candidates[i]);
    record_step();
    while (exchange()) {
    }
    return true;
  }

  void record_step() {
    Step step;
    for (const std::size_t effect : found_) step.effects.push_back({effect, estimates_of(effect, current_)});
    result_.steps.push_back(std::move(step));
  }

  /// What was the best name while another effect was still missing need not be the best beside it: each but
  /// the last is exchanged for what had resembled it, where that does better now. Whether one was.
  bool exchange() {
    for (std::size_t i = 0; i + 1 < found_.size(); ++i) {
      const std::size_t effect = found_[i];
      std::vector<std::size_t> others;
      for (const std::size_t other : near_[effect])
        if (!is_found(other) && !exchanged_.contains({effect, other})) others.push_back(other);
      if (others.empty()) continue;
      tell(0.8, "is it still " + kind_of(effect));
      const Hypothesis without = search_->without(current_, effect);
      if (!std::isfinite(without.train.objective)) continue;
      const double to_beat = search_->sieved(current_).train.objective - price_of(effect);
      for (const std::size_t other : others) {
        exchanged_.insert({effect, other});
        Hypothesis h = search_->screened(without, other);
        if (!(h.train.objective + price_of(other) < to_beat + confusable_evidence)) continue;
        search_->refine(without, h);
        const Improvement improvement = compare(current_, h);
        const double evidence = improvement.train + price_of(effect) - price_of(other);
        if (!(evidence > confusable_evidence) || !(improvement.held > 0.0)) continue;
        if (!is_plausible(h, other) || certainty(h, other) < least_certainty || !simulates_as_well(h))
          continue;
        where_[other] = where_.at(effect);
        near_[other] = near_[effect];
        near_[other].push_back(effect);
        current_ = std::move(h);
        found_[i] = other;
        record_step();
        return true;
      }
    }
    return false;
  }

  /// Two effects can hide each other, so that a third, which resembles both, is found instead. Every pair of
  /// these is tried in the place of what was found of them, once. Whether one is better.
  bool try_pairs(const std::vector<std::pair<std::size_t, Hypothesis>>& contenders) {
    std::optional<Hypothesis> best;
    std::vector<std::size_t> best_found;
    for (std::size_t a = 0; a < contenders.size(); ++a)
      for (std::size_t b = a + 1; b < contenders.size(); ++b) {
        const std::size_t first = contenders[a].first, second = contenders[b].first;
        if (found_.size() > 2 || (found_.size() == 2 && is_found(first) && is_found(second))) continue;
        if (!paired_.insert(std::minmax(first, second)).second) continue;
        tell(0.83, "trying " + kind_of(first) + " with " + kind_of(second));
        const Hypothesis& so_far = best ? *best : current_;
        const Hypothesis quick = search_->screened_pair(given_, contenders[a].second, contenders[b].second);
        if (!(quick.train.objective < search_->sieved(so_far).train.objective)) continue;
        Hypothesis h = search_->with_pair(given_, contenders[a].second, contenders[b].second);
        const Improvement improvement = compare(so_far, h);
        const double price = parameter_price * static_cast<double>(h.free.size() - current_.free.size());
        if (improvement.train - price < least_evidence || improvement.held < 0.0) continue;
        if (!is_plausible(h, first) || !is_plausible(h, second)) continue;
        if (certainty(h, first) < least_certainty || certainty(h, second) < least_certainty) continue;
        if (!simulates_as_well(h)) continue;
        best = std::move(h);
        best_found = {first, second};
      }
    if (!best) return false;
    for (const std::size_t effect : best_found)
      if (!where_.contains(effect)) where_[effect] = where_.empty() ? locate(given_) : where_.begin()->second;
    current_ = std::move(*best);
    found_ = best_found;
    record_step();
    return true;
  }

  /// Drops what is not needed, settles the corrections, and looks at what is left.
  ResidualStructure settle() {
    prune();
    settle_corrections();
    tell(0.92, "measuring the gap");
    ResidualStructure left = examine();
    if (!left.structured) compare_held_out(left);
    return left;
  }

  /// Backward deletion: what is no longer needed once others are there goes.
  void prune() {
    bool again = found_.size() > 1;
    while (again) {
      again = false;
      for (std::size_t i = 0; i < found_.size(); ++i) {
        tell(0.85, "is " + kind_of(found_[i]) + " still needed");
        Hypothesis h = search_->without(current_, found_[i]);
        if (!std::isfinite(h.train.objective)) continue;
        const Improvement improvement = compare(h, current_);
        if (improvement.train - price_of(found_[i]) > least_evidence && improvement.t_value > 0.7 * least_t)
          continue;
        current_ = std::move(h);
        found_.erase(found_.begin() + static_cast<std::ptrdiff_t>(i));
        record_step();
        again = found_.size() > 1;
        break;
      }
    }
  }

  /// Which of the corrections that every fit was left room for are really there: the least certain is set
  /// back to what the plant file says, the others follow (a Gaussian approximation of the likelihood), until
  /// all that are left are certain.
  void settle_corrections() {
    const Hypothesis& h = current_;
    std::vector<std::size_t> open;
    for (std::size_t j = 0; j < h.free.size(); ++j) open.push_back(j);
    Eigen::VectorXd value(static_cast<Eigen::Index>(h.free.size()));
    for (std::size_t j = 0; j < h.free.size(); ++j)
      value[static_cast<Eigen::Index>(j)] =
          h.train.point.plant.find(h.free[j].effect)->values[h.free[j].index];
    Eigen::MatrixXd covariance = h.train.covariance;
    const auto is_correction = [&](std::size_t j) {
      return std::find(found_.begin(), found_.end(), h.free[j].effect) == found_.end();
    };
    for (;;) {
      double least = infinity;
      std::size_t place = 0;
      for (std::size_t a = 0; a < open.size(); ++a) {
        if (!is_correction(open[a])) continue;
        const auto at = static_cast<Eigen::Index>(a);
        const double z = std::abs(value[at] - h.free[open[a]].prior_mean) /
                         std::sqrt(std::max(covariance(at, at), 1e-300));
        if (z < least) {
          least = z;
          place = a;
        }
      }
      if (!(least < least_correction_z)) break;
      const auto at = static_cast<Eigen::Index>(place);
      const double step = h.free[open[place]].prior_mean - value[at];
      const Eigen::VectorXd column = covariance.col(at) / std::max(covariance(at, at), 1e-300);
      value += column * step;
      covariance -= column * covariance.row(at).eval();
      const Eigen::Index n = value.size();
      Eigen::VectorXd smaller_value(n - 1);
      Eigen::MatrixXd smaller(n - 1, n - 1);
      for (Eigen::Index i = 0, a = 0; i < n; ++i) {
        if (i == at) continue;
        smaller_value[a] = value[i];
        for (Eigen::Index j = 0, b = 0; j < n; ++j)
          if (j != at) smaller(a, b++) = covariance(i, j);
        ++a;
      }
      value = smaller_value;
      covariance = smaller;
      open.erase(open.begin() + static_cast<std::ptrdiff_t>(place));
    }
    std::vector<std::size_t> corrections;
    for (const std::size_t j : open)
      if (is_correction(j) && !is_within_belief(h, j) && is_plausible(h, h.free[j].effect) &&
          std::find(corrections.begin(), corrections.end(), h.free[j].effect) == corrections.end())
        corrections.push_back(h.free[j].effect);
    fit_last(corrections);
    order_corrections(corrections);
  }

  /// The last fits, of training runs and of all. A correction that these leave uncertain is none: it goes.
  void fit_last(std::vector<std::size_t>& corrections) {
    const Hypothesis* from = &current_;
    for (;;) {
      tell(0.88, "fitting what is left");
      std::vector<std::size_t> all = found_;
      all.insert(all.end(), corrections.begin(), corrections.end());
      final_ = search_->only(all, *from, nullptr, true);
      search_->judge(final_, final_.train.point.noise);
      from = &final_;
      tell(0.9, "fitting all runs");
      known_ = search_->on_all(final_);
      const auto includes_nothing = [&](std::size_t effect) { return certainty(known_, effect) < 2.0; };
      const auto gone = std::remove_if(corrections.begin(), corrections.end(), includes_nothing);
      if (gone == corrections.end()) return;
      corrections.erase(gone, corrections.end());
    }
  }

  /// A coefficient of the plant file that moved no further than such coefficients do from day to day: the
  /// number is set right, but nothing was missing.
  bool is_within_belief(const Hypothesis& h, std::size_t j) const {
    const FreeParameter& p = h.free[j];
    if (effect_registry()[p.effect].enters == Enters::parameter || plant_.find(p.effect) == nullptr)
      return false;
    constexpr double far = 3.0;
    return std::abs(h.train.point.plant.find(p.effect)->values[p.index] - p.prior_mean) < far * p.prior_sigma;
  }

  double gap_of(const Hypothesis& h) const {
    return held_.segments.empty() ? whitened_rms(h.train) : whitened_rms(h.held);
  }

  /// Corrections in the order of how much each closes.
  void order_corrections(const std::vector<std::size_t>& corrections) {
    const Noise noise = final_.train.point.noise;
    std::vector<std::pair<double, std::size_t>> opened;
    for (const std::size_t effect : corrections) {
      std::vector<std::size_t> others = found_;
      for (const std::size_t other : corrections)
        if (other != effect) others.push_back(other);
      Hypothesis h = search_->only(others, final_, &noise);
      search_->judge(h, noise);
      opened.emplace_back(-gap_of(h), effect);
    }
    std::sort(opened.begin(), opened.end());
    corrections_.clear();
    for (const auto& [gap, effect] : opened) corrections_.push_back(effect);
  }

  void conclude(const ResidualStructure& structure) {
    tell(0.93, "measuring the gap");
    result_.noise = known_.train.point.noise;
    const std::vector<std::size_t> all = all_found();
    const Noise& fitted_noise = final_.train.point.noise;
    const Noise quiet = sensor_noise(final_);
    // Of what is left but cannot be told from noise, the floor is what such noise makes; else the sensors
    // alone.
    const double floor = structure.structured ? 1.0 : floor_of(final_, structure).usual;
    const auto gap_with = [&](const std::vector<std::size_t>& effects, const Hypothesis& from, bool settled) {
      Hypothesis h = search_->only(effects, from, &fitted_noise, settled);
      search_->judge(h, quiet);
      return gap_of(h) / floor;
    };
    double gap = result_.gap_before = gap_with({}, final_, false);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const std::vector<std::size_t> first(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      FoundEffect found;
      found.effect = all[i];
      found.gap_before = gap;
      gap = gap_with(first, final_, i + 1 == all.size());
      found.gap_after = gap;
      found.parameters = estimates_of(all[i], known_);
      if (where_.contains(all[i])) found.where = where_.at(all[i]);
      result_.effects.push_back(found);
    }
    result_.gap_after = gap;
    result_.residual = structure.sentence;
    result_.model = final_model();
    for (auto& candidate : result_.candidates) {
      candidate.gap_after = result_.gap_before;
      for (auto& [effect, h] : finalists_) {
        if (effect != candidate.effect) continue;
        candidate.evidence = compare(given_, h).train;
        candidate.gap_after = simulation_gap(h) / floor;
      }
    }
    std::stable_sort(result_.candidates.begin(), result_.candidates.end(),
                     [](const auto& a, const auto& b) { return a.evidence > b.evidence; });
    decide(structure);
    trace_residuals();
    find_confusable();
  }

  SimulationFloor floor_of(const Hypothesis& h, const ResidualStructure& structure) const {
    if (held_.segments.empty()) return {};
    FitPoint point = h.held.point;
    point.noise = as_slow_as_left(h.train.point.noise, structure);
    return simulation_floor(held_, point);
  }

  void trace_residuals() {
    if (held_.segments.empty()) return;
    const Noise noise = final_.train.point.noise;
    result_.residual_after = smooth_residuals(held_, final_.held.point);
    Hypothesis as_given = search_->only({}, final_, &noise);
    search_->judge(as_given, noise);
    result_.residual_before = smooth_residuals(held_, as_given.held.point);
  }

  static Noise sensor_noise(const Hypothesis& h) {
    Noise noise = h.train.point.noise;
    noise.force = noise.torque = 0.0;
    noise.sensors = 1.0;
    return noise;
  }

  ResidualStructure examine() {
    FitData all{&runs_, train_.segments};
    all.segments.insert(all.segments.end(), held_.segments.begin(), held_.segments.end());
    // At what all runs say, so that what few training runs left uncertain is not taken for something missing.
    ResidualStructure structure = examine_residuals(all, known_.train.point);
    FitPoint point = known_.train.point;
    point.noise = sensor_noise(known_);
    const FitResult plain = follow(all, point);
    structure.noise_ratio = whitened_rms(plain);
    point = plain.point;
    point.noise = as_slow_as_left(known_.train.point.noise, structure);
    structure.excess = structure.noise_ratio / simulation_floor(all, point).highest;
    judge_structure(structure);
    return structure;
  }

  /// What is left of the training runs must account for the held-out runs too, with the parameters anywhere
  /// that the training runs leave open. What is left need not be white: all runs together may be further off
  /// than white noise makes them, and held-out ones by as much again.
  void compare_held_out(ResidualStructure& structure) {
    if (held_.segments.empty()) return;
    Hypothesis told = search_->told(final_);
    const double excess = simulation_gap(told) / floor_of(told, structure).highest;
    if (!(excess > most_excess * std::max(1.0, structure.excess))) return;
    structure.structured = true;
    std::ostringstream text;
    text.precision(3);
    text << "a plain simulation of held-out runs is " << excess
         << " times as far off as noise like what is left of the others makes it at most";
    structure.sentence = text.str();
  }

  std::vector<std::size_t> all_found() const {
    std::vector<std::size_t> all = found_;
    all.insert(all.end(), corrections_.begin(), corrections_.end());
    return all;
  }

  static void judge_structure(ResidualStructure& s) {
    std::ostringstream text;
    text.precision(3);
    if (s.noise_ratio < 1.15) {
      text << "what is left is the sensors' own noise";
    } else if (s.dispersion > 1.6) {
      s.structured = true;
      text << "what is left comes in bursts: some stretches are " << s.dispersion
           << " times as far off as most";
    } else if (s.tails.kurtosis > heaviest_tails && s.tails.certainty > least_dependence) {
      s.structured = true;
      text << "what is left comes in bursts: short pulses of force have a kurtosis of " << s.tails.kurtosis
           << ", chance gives 3 (largest blocks " << s.dispersion << " times the median, dependence "
           << s.certainty << " standard errors)";
    } else if (std::max(s.slow_force, s.slow_torque) > slowest) {
      s.structured = true;
      const bool torque = s.slow_torque > s.slow_force;
      text << "what is left is too slow for noise: over a tenth of a second the "
           << (torque ? "torque on the pendulum" : "force on the cart") << " is "
           << (torque ? s.slow_torque : s.slow_force)
           << " times as large as noise that accounts for single samples makes it";
    } else if (s.excess > most_excess) {
      s.structured = true;
      text << "a plain simulation is " << s.excess
           << " times as far off as noise like what is left makes it at most"
           << " (dependence " << s.certainty << " standard errors)";
    } else if (s.certainty > least_dependence) {
      s.structured = true;
      text << "what is left goes with " << s.goes_with << " in the " << (s.in_pendulum ? "pendulum" : "cart")
           << " equation (" << s.certainty << " standard errors)";
    } else {
      text << "what is left is a disturbance that is the same all along and goes with nothing that was "
              "measured "
              "(largest blocks "
           << s.dispersion << " times the median, kurtosis of pulses " << s.tails.kurtosis << ", dependence "
           << s.certainty << " standard errors, simulation " << s.excess
           << " times as far off as such noise makes it at most, slow pushes "
           << std::max(s.slow_force, s.slow_torque) << " times)";
    }
    s.sentence = text.str();
  }

  /// The plant file with the effects added. What moved within what is believed of it goes into the numbers
  /// that were there.
  Plant final_model() {
    Plant model = plant_;
    const std::vector<std::size_t> all = all_found();
    if (all.empty()) return model;
    const Plant& fitted = known_.train.point.plant;
    for (const std::size_t effect : search_->nuisances()) {
      if (std::find(all.begin(), all.end(), effect) != all.end()) continue;
      if (plant_.find(effect) != nullptr) {
        model.set(effect, fitted.find(effect)->values);
      } else if (effect_registry()[effect].enters == Enters::parameter) {
        fold(model, effect, fitted.find(effect)->values[0]);
      }
    }
    for (const std::size_t effect : all) model.set(effect, fitted.find(effect)->values);
    return model;
  }

  /// Puts the scale of a base parameter into the plant's own numbers.
  static void fold(Plant& plant, std::size_t effect, double scale) {
    Plant scaled = plant;
    scaled.set(effect, std::vector<double>{scale});
    const BaseParameters<double> base = make_model<double>(scaled).corrected();
    plant.cart_mass_kg = base.cart_mass_kg;
    plant.motor.back_emf_n_per_mps = base.back_emf_n_per_mps;
    if (!plant.pendulum) return;
    const bool rod = !plant.pendulum->given_inertia_kgm2;
    plant.pendulum->mass_kg = base.pendulum_mass_kg;
    plant.pendulum->length_to_com_m = base.length_to_com_m;
    if (!rod) plant.pendulum->given_inertia_kgm2 = base.inertia_about_pivot_kgm2;
  }

  void decide(const ResidualStructure& structure) {
    if (structure.structured) {
      result_.verdict = Verdict::unexplained;
    } else if (!result_.effects.empty()) {
      result_.verdict = Verdict::explained;
    } else {
      result_.verdict = moved() ? Verdict::no_discrepancy : Verdict::not_excited;
    }
  }

  /// Whether anything moved far enough to show an effect: well beyond the sensors' steps.
  bool moved() const {
    constexpr double least_steps = 30.0;
    for (const Measurement& run : runs_) {
      const auto range = [](const std::vector<double>& values) {
        const auto [low, high] = std::minmax_element(values.begin(), values.end());
        return values.empty() ? 0.0 : *high - *low;
      };
      if (range(run.cart_m) > least_steps * std::sqrt(12.0) * run.cart_noise_m()) return true;
      if (range(run.theta_rad) > least_steps * std::sqrt(12.0) * run.theta_noise_rad()) return true;
    }
    return false;
  }

  /// Other effects that do as well in the place of one that was found: from sensitivities, or fitted where an
  /// effect does not act in proportion to its size.
  void find_confusable() {
    tell(0.94, "what else could it be");
    std::vector<std::pair<std::size_t, Plant>> rivals;
    for (const Rival& rival : linear_rivals(*search_, final_, all_found())) {
      declare(rival.instead_of, rival.effect);
      rivals.emplace_back(rival.effect, rival.plant);
    }
    std::optional<double> sieved;
    for (const std::size_t effect : found_) {
      std::optional<Hypothesis> without;
      for (const std::size_t other : near_[effect]) {
        if (is_listed(other) || is_declared(effect, other)) continue;
        tell(0.95, "is it " + kind_of(other) + " instead of " + kind_of(effect));
        if (!without) without = search_->without(current_, effect);
        if (!std::isfinite(without->train.objective)) break;
        Hypothesis rival = search_->screened(*without, other);
        search_->settle_on_sieve(rival);
        if (!sieved) sieved = search_->sieved(current_).train.objective;
        // So much worse on a part, it is no better on the whole.
        if (!(rival.train.objective - *sieved < most_scattered)) continue;
        rival.train.point.noise = current_.train.point.noise;
        search_->refit(*without, rival);
        const Improvement worse = compare(rival, current_);
        if (!is_plausible(rival, other)) continue;
        const bool same =
            worse.train < confusable_evidence || (worse.train < most_scattered && worse.t_value < 2.0);
        if (!same) continue;
        declare(effect, other);
        rivals.emplace_back(other, rival.train.point.plant);
      }
    }
    if (!rivals.empty()) result_.next_experiment = choose_experiment(final_.train.point.plant, rivals, runs_);
  }

  bool is_found(std::size_t effect) const {
    return std::find(found_.begin(), found_.end(), effect) != found_.end();
  }
  FoundEffect& listed(std::size_t effect) {
    return *std::find_if(result_.effects.begin(), result_.effects.end(),
                         [&](const FoundEffect& found) { return found.effect == effect; });
  }
  bool is_listed(std::size_t effect) const {
    const std::vector<std::size_t> all = all_found();
    return std::find(all.begin(), all.end(), effect) != all.end();
  }
  bool is_declared(std::size_t effect, std::size_t other) {
    const std::vector<std::size_t>& others = listed(effect).confusable_with;
    return std::find(others.begin(), others.end(), other) != others.end();
  }
  void declare(std::size_t effect, std::size_t other) { listed(effect).confusable_with.push_back(other); }

  const Plant plant_;
  const std::vector<Measurement>& runs_;
  const DiagnosisOptions& options_;
  FitData train_, held_;
  std::optional<Search> search_;
  Hypothesis given_, current_;
  Hypothesis final_;  ///< fitted to the training runs, judged on the others
  Hypothesis known_;  ///< the same effects fitted to all runs: what the model says in the end
  std::optional<Standing> standing_;
  std::vector<std::size_t> found_, corrections_;
  std::set<std::pair<std::size_t, std::size_t>> exchanged_;  ///< tried already
  std::map<std::size_t, std::vector<std::size_t>> near_;
  std::map<std::size_t, std::string> where_;
  std::vector<std::pair<std::size_t, Hypothesis>> finalists_;
  std::vector<std::pair<std::size_t, Hypothesis>> resembling_;  ///< screened, of the first round
  std::set<std::pair<std::size_t, std::size_t>> paired_;        ///< tried already
  Diagnosis result_;
};

}  // namespace

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::explained:
      return "explained";
    case Verdict::no_discrepancy:
      return "no_discrepancy";
    case Verdict::unexplained:
      return "unexplained";
    case Verdict::not_excited:
      return "not_excited";
  }
  return "";
}

Diagnosis diagnose(const Plant& plant, const std::vector<Measurement>& runs,
                   const DiagnosisOptions& options) {
  if (runs.empty()) throw ConfigError("name at least one run with --data");
  const std::string fault = fault_of(plant);
  if (!fault.empty()) throw ConfigError(fault);
  const bool shared = std::any_of(runs.begin(), runs.end(), [&](const Measurement& run) {
    return run.has_cart() || (run.has_theta() && plant.pendulum);
  });
  if (!shared)
    throw ConfigError(
        "add the pendulum to the plant file: the runs hold theta_rad only, and the model is a cart alone");
  return Diagnostician(plant, runs, options).run();
}

}  // namespace upright
