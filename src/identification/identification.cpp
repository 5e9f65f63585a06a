#include "identification.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "base/parallel.hpp"
#include "diagnosis/adequacy.hpp"
#include "diagnosis/candidates.hpp"
#include "diagnosis/plant_scale.hpp"
#include "diagnosis/score_test.hpp"
#include "estimation/held_out.hpp"
#include "estimation/thinning.hpp"
#include "run_order.hpp"

namespace upright {

namespace {

constexpr double max_samples = 60000.0;
constexpr double trial_samples = 10000.0;
constexpr double few_samples = 2500.0;
/// Of the runs that are held out, and of the others, when it is judged.
constexpr double judged_samples = 20000.0;
/// A simulation of runs that the fit did not see may be this many times as far off as the largest of some
/// dozens of draws of the noise. A right model comes to 1; what it is more, its numbers make up for
/// elsewhere.
constexpr double max_held_out = 1.2;
/// What an effect that is not fitted may promise of minus twice the log likelihood: some 25 with up to three
/// parameters are asked, of which chance gives the best about 10.
constexpr double max_promised = 40.0;

constexpr std::string_view frictions[] = {"viscous_friction",
                                          "coulomb_friction",
                                          "friction_asymmetry",
                                          "viscous_asymmetry",
                                          "stribeck_friction",
                                          "bristle_friction",
                                          "quadratic_drag",
                                          "constant_force",
                                          "pivot_viscous_friction",
                                          "pivot_coulomb_friction",
                                          "position_dependent_friction",
                                          "cart_mass",
                                          "pendulum_length"};

std::string text(const char* format, double a, double b = 0.0) {
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, format, a, b);
  return buffer;
}

/// A model under way: the plant with its free effects, and the fit of it.
struct Model {
  Plant plant;
  std::vector<std::size_t> free;
  FitResult fit;
};

class Identifier {
 public:
  Identifier(const Plant& base, const std::vector<Measurement>& runs, const IdentificationOptions& options)
      : policy_(policy_for(base)),
        base_(base),
        order_(canonical_order(runs)),
        runs_(arranged(runs, order_)),
        options_(options),
        range_(range_of(runs_, base, policy_.excitation)) {}

  Identification run() {
    try {
      find();
    } catch (const Interrupted&) {
      result_.interrupted = true;
      result_.verdict = Verdict::unexplained;
      result_.residual = "not examined: the work was not finished";
      result_.parameters.clear();
      if (std::isfinite(so_far_.fit.objective) && so_far_.fit.covariance.size() > 0) report(so_far_);
    }
    result_.breakaways = in_given_order(std::move(result_.breakaways), order_);
    result_.steady_points = in_given_order(std::move(result_.steady_points), order_);
    return std::move(result_);
  }

 private:
  void find() {
    result_.plant = base_;
    result_.breakaways = find_breakaways(runs_, base_);
    result_.steady_points = find_steady_points(runs_, base_);
    result_.balance = balance_forces(runs_, base_);
    const std::vector<Segment> segments = moving_segments(runs_);
    if (segments.empty() || !moves_enough(runs_, policy_.excitation)) {
      result_.verdict = Verdict::not_excited;
      result_.residual = "too little moves in these data to show anything";
      return;
    }
    whole_ = {&runs_, thinned(segments, max_samples)};
    trial_ = {&runs_, thinned(segments, trial_samples)};
    few_ = {&runs_, thinned(segments, few_samples)};
    report_progress(0.05, "force balance");
    Model model = start();
    model = fitted(model, trial_, 8, 1);
    so_far_ = model;
    model = or_with_less_noise(model);
    so_far_ = model;
    const bool transition = range_.cart_moves && starts_from_rest() && grow(model);
    so_far_ = model;
    if (transition) model = or_with_less_noise(model);
    report_progress(0.6, "fitting all parameters");
    model = fitted(model, whole_, 12, 2);
    so_far_ = model;
    report_progress(0.75, "testing the residual");
    judge(model);
    report(model);
    if (result_.verdict == Verdict::explained) {
      flag_undetermined_parameters();
    } else if (!transition && result_.balance) {
      use_force_balance();
    }
  }

  /// Whether the model accounts for the data: what it leaves is noise, and what it says of runs that its fit
  /// did not see is no further off.
  void judge(const Model& model) {
    result_.verdict = Verdict::unexplained;
    if (!std::isfinite(model.fit.objective)) {
      result_.residual = "the model cannot be simulated with these runs";
      return;
    }
    DataSplit data = split(runs_, HeldOut::end, policy_.excitation.arm_m, policy_.excitation.speed_window_s);
    for (FitData* part : {&data.train, &data.held}) part->segments = thinned(part->segments, judged_samples);
    const Model trained = fitted(model, data.train, 12, 1);
    const Search search(base_, runs_, data.train, data.held, policy_, budget_);
    Hypothesis judged;
    judged.train = trained.fit;
    judged.free = parameters_of(trained);
    judged.valid = std::isfinite(trained.fit.objective);
    if (!judged.valid) {
      result_.residual = "the model cannot be simulated with these runs";
      return;
    }
    ResidualTests left = examine_fit(whole_, model.fit.point, policy_, budget_);
    search.filter_held_out(judged, sensors_only(judged.train.point.noise));
    if (!left.structured) compare_held_out(search, judged, judged.train.point.noise, left);
    const SimulationFloor noise =
        left.structured ? SimulationFloor{} : held_out_floor(search, judged, judged.train.point.noise, left);
    const double floor = noise.usual;
    result_.gap_after = search.gap_of(judged) / floor;
    if (!left.structured) {
      const ScoreTestResult missing = best_by_score_test(data.train, trained.fit, judged.free, search,
                                                         {"stribeck_friction", "bristle_friction"});
      left.structured = missing.fall > max_promised;
      if (left.structured)
        left.sentence = "what is left looks like " + kind_of(missing.effect) +
                        ", which identify does not fit" +
                        text(" (it promises %.3g of minus twice the log likelihood)", missing.fall);
    }
    if (!left.structured && search.gap_of(judged) > max_held_out * noise.highest) {
      left.structured = true;
      left.sentence = text(
          "a simulation of runs that the fit did not see is %.3g times as far off as noise like "
          "what is left makes it at most",
          search.gap_of(judged) / noise.highest);
    }
    Hypothesis given;
    given.train.point = {base_, {}, judged.train.point.noise};
    search.filter_held_out(given, sensors_only(judged.train.point.noise));
    result_.gap_before = search.gap_of(given) / floor;
    result_.residual = left.sentence;
    if (!left.structured) result_.verdict = Verdict::explained;
  }

  /// Numbers that account for the data are the rig's only where the data leave them no choice.
  void flag_undetermined_parameters() {
    // So far off, a mass or a friction is of no use for a controller.
    constexpr double widest = 0.25;
    for (const IdentifiedParameter& p : result_.parameters) {
      const double half = 0.5 * (p.high - p.low);
      const bool mass = p.name == "cart_mass_kg" || p.name == "pendulum.length_to_com_m";
      const bool level = p.name == "coulomb_friction.force_n";
      const double size = level ? widest * range_.largest_force_n : std::abs(p.value);
      if (!(mass || level) || half <= widest * size) continue;
      result_.verdict = Verdict::not_excited;
      result_.residual = "these data leave " + p.name + " open: " + text("%.3g to %.3g", p.low, p.high);
    }
  }

  void report_progress(double done, const std::string& what) const {
    if (options_.progress) options_.progress(done, what);
  }

  /// The effects every cart has, from the readings.
  Model start() const {
    Model model;
    model.plant = base_;
    for (const std::string_view kind : frictions) model.plant.remove(effect_number(kind));
    const auto add = [&](std::string_view kind, std::vector<double> values) {
      model.plant.set(effect_number(kind), values);
      model.free.push_back(effect_number(kind));
    };
    if (range_.cart_moves) {
      ForceBalance b;
      if (result_.balance) {
        b = *result_.balance;
      } else {
        b.mass_kg = base_.cart_mass_kg;
        b.coulomb_n = 0.05 * range_.largest_force_n;
      }
      add("viscous_friction", {std::max(b.damping_n_per_mps - base_.motor.back_emf_n_per_mps, 1e-3)});
      add("coulomb_friction", {std::max(b.coulomb_n, 1e-3 * range_.largest_force_n)});
      add("constant_force", {b.constant_n});
      add("cart_mass", {std::clamp(b.mass_kg / base_.cart_mass_kg, 0.35, 2.9)});
    }
    const bool decays =
        std::any_of(runs_.begin(), runs_.end(), [](const Measurement& run) { return run.cart_locked; });
    if (base_.pendulum && decays) {
      add("pivot_viscous_friction", {1e-4});
      add("pivot_coulomb_friction", {1e-4});
      add("pendulum_length", {1.0});
    }
    return model;
  }

  /// `mass_known_to` is a share of where the mass is now; 0: nothing is believed of it.
  std::vector<FreeParameter> parameters_of(const Model& model, double mass_known_to = 0.0) const {
    std::vector<FreeParameter> free;
    for (const std::size_t effect : model.free)
      for (FreeParameter p : free_parameters(effect, range_, policy_.prior)) {
        // Nothing is believed beforehand, except that a shape without data stays near 2.
        if (p.prior_sigma > 0.0) p.prior_sigma *= 4.0;
        if (mass_known_to > 0.0 && effect == effect_number("cart_mass")) {
          p.prior_mean = model.plant.find(effect)->values[0];
          p.prior_sigma = mass_known_to * p.prior_mean;
        }
        free.push_back(p);
      }
    return free;
  }

  Model fitted(Model model, const FitData& data, int iterations, int noise_rounds,
               double mass_known_to = 0.0) const {
    FitPoint point;
    point.plant = model.plant;
    point.noise = model.fit.covariance.size() > 0 ? model.fit.point.noise : Noise{};
    if (model.fit.covariance.size() == 0) point.noise.force = 0.01 * range_.largest_force_n;
    point.starts = estimate_initial_states(runs_, data.segments, model.plant);
    point = with_fitted_initial_states(data, std::move(point));
    FitOptions fit_options;
    fit_options.max_iterations = iterations;
    fit_options.noise_rounds = noise_rounds;
    model.fit = fit(data, point, parameters_of(model, mass_known_to), fit_options);
    if (std::isfinite(model.fit.objective)) model.plant = model.fit.point.plant;
    return model;
  }

  /// The model, or what it is when it is fitted again with little process noise, if that is more likely.
  /// Process noise that made up for parameters that were not right yet keeps them from getting right.
  Model or_with_less_noise(const Model& model) const {
    Model less = model;
    less.fit.point.noise = reduced_process_noise(less.fit.point.noise);
    less = fitted(less, trial_, 16, 1);
    return rank_of(less) < rank_of(model) ? less : model;
  }

  /// How friction changes between rest and sliding shows only where the cart rested and then went.
  bool starts_from_rest() {
    constexpr double rest_s = 0.1;
    constexpr int min_starts = 3;
    int starts = 0;
    for (const Measurement& run : runs_) {
      if (!run.has_cart()) continue;
      const double step = 1.5 * std::max(run.cart_resolution_m, 4.0 * run.cart_noise_m());
      const auto rest = static_cast<std::size_t>(rest_s / run.median_period_s());
      std::size_t since = 0;
      for (std::size_t k = 1; k < run.size(); ++k) {
        if (std::abs(run.cart_m[k] - run.cart_m[since]) <= step) continue;
        if (k - since > rest) ++starts;
        since = k;
      }
    }
    if (starts < min_starts)
      result_.notes.push_back(
          "the cart never goes from rest in these data: nothing is said of the Stribeck rise and of "
          "bristles");
    return starts >= min_starts;
  }

  struct Addition {
    std::string_view kind;
    std::vector<double> values;
  };

  using Start = std::vector<Addition>;

  static double rank_of(const Model& model) {
    return std::isfinite(model.fit.objective) ? model.fit.objective : std::numeric_limits<double>::infinity();
  }

  /// A model with more effects, not fitted yet. Noise that made up for what was missing is not where to start
  /// from.
  static Model richer(const Model& base, const Start& start) {
    Model model{base.plant, base.free, {}};
    for (const Addition& addition : start) {
      const std::size_t effect = effect_number(addition.kind);
      model.plant.set(effect, addition.values);
      if (std::find(model.free.begin(), model.free.end(), effect) == model.free.end())
        model.free.push_back(effect);
    }
    return model;
  }

  static std::vector<Model> richer(const Model& base, const std::vector<Start>& starts) {
    std::vector<Model> models;
    models.reserve(starts.size());
    for (const Start& start : starts) models.push_back(richer(base, start));
    return models;
  }

  /// Fits each to few data, the better ones to more, and the best two to the end: where friction and bristles
  /// trade with each other, the start that looks best at first may lead to a lesser optimum. At first the
  /// mass, which accelerations show whatever the friction, stays near where it is, and makes up for no
  /// friction that is not right yet.
  Model best_of(std::vector<Model> models) const {
    struct Round {
      const FitData& data;
      int iterations, noise_rounds;
      double mass_known_to;
      std::size_t kept;
    };
    const Round rounds[] = {{few_, 6, 1, 0.02, 3}, {trial_, 8, 1, 0.05, 2}, {trial_, 12, 2, 0.0, 1}};
    for (const Round& round : rounds) {
      for (Model& model : models)
        model = fitted(model, round.data, round.iterations, round.noise_rounds, round.mass_known_to);
      std::stable_sort(models.begin(), models.end(),
                       [](const Model& x, const Model& y) { return rank_of(x) < rank_of(y); });
      models.resize(std::min(round.kept, models.size()));
    }
    return models.front();
  }

  /// Keeps the best of what was tried with these effects when the data ask for it. Whether they do.
  bool keep(Model& model, const Model& best, const std::vector<std::string_view>& kinds) {
    if (!std::isfinite(best.fit.objective)) return false;
    const double evidence = model.fit.objective - best.fit.objective;
    bool sized = true;
    std::string names;
    for (const std::string_view kind : kinds) {
      names += (names.empty() ? "" : " and ") + std::string(kind);
      const std::size_t effect = effect_number(kind);
      sized = sized &&
              best.plant.find(effect)->values[0] > policy_.significance.certain_z * sigma_of(best, effect, 0);
    }
    const bool kept = evidence > policy_.acceptance.min_evidence && sized;
    const std::string size =
        text("(evidence %.0f, %.0f is asked for)", evidence, policy_.acceptance.min_evidence);
    const std::string why = evidence < 0.5 ? "with which the fit is no better"
                            : sized        ? "with which the fit is hardly better " + size
                                           : "whose size is not certain";
    result_.notes.push_back(kept ? "taken: " + names + ", which improves the fit " + size
                                 : "left out: " + names + ", " + why);
    if (kept) model = best;
    return kept;
  }
  /// True when the data show how friction changes between rest and sliding.
  bool grow(Model& model) {
    const Model plain = model;
    const double sliding = model.plant.find("coulomb_friction")->values[0];
    double breakaway = 0.0;
    for (const Breakaway& b : result_.breakaways)
      breakaway += std::abs(b.force_n) / static_cast<double>(result_.breakaways.size());
    const double fast = range_.largest_speed_mps;
    // One level for all speeds lies somewhere between rest and fast sliding: the rise begins as a part of it,
    // or on top.
    const auto part = [&](const Model& base, double velocity, double shape) {
      const double half = 0.5 * base.plant.find("coulomb_friction")->values[0];
      return Start{{"coulomb_friction", {half}}, {"stribeck_friction", {half, velocity * fast, shape}}};
    };
    const auto on_top = [&](double velocity, double shape) {
      const double extra = std::max(breakaway - sliding, 0.3 * std::max(sliding, 0.03));
      return Start{{"stribeck_friction", {extra, velocity * fast, shape}}};
    };
    std::vector<Start> bristles, both;
    for (const double stiffness : {100.0, 1000.0}) {
      const double critical = std::sqrt(stiffness * model.plant.cart_mass_kg);
      for (const double damping : {1.0, 5.0}) {
        bristles.push_back({{"bristle_friction", {stiffness, damping * critical}}});
        for (const double velocity : {0.07, 0.2}) {
          both.push_back(part(plain, velocity, 2.0));
          both.back().push_back(bristles.back().front());
        }
      }
    }
    report_progress(0.15, "fitting Stribeck friction");
    const Model risen = best_of(
        richer(plain, {on_top(0.05, 1.5), on_top(0.15, 2.0), on_top(0.3, 2.0), part(plain, 0.15, 2.0)}));
    bool found = keep(model, risen, {"stribeck_friction"});
    report_progress(0.25, "fitting bristle friction");
    const Model bristled = best_of(richer(plain, bristles));
    found = keep(model, bristled, {"bristle_friction"}) || found;
    // Each may hide behind the other: a rise that is seen through bristles, and bristles through a rise. And
    // what has both can do no worse than what has one, from where that one ended.
    report_progress(0.4, "fitting Stribeck and bristle friction");
    std::vector<Model> models = richer(plain, both);
    if (std::isfinite(risen.fit.objective))
      for (const Start& start : bristles) models.push_back(richer(risen, start));
    if (std::isfinite(bristled.fit.objective))
      for (const double velocity : {0.07, 0.2})
        for (const Start& start : {part(bristled, velocity, 2.0), on_top(velocity, 2.0)})
          models.push_back(richer(bristled, start));
    return keep(model, best_of(std::move(models)), {"stribeck_friction", "bristle_friction"}) || found;
  }

  double sigma_of(const Model& model, std::size_t effect, std::size_t index) const {
    const std::vector<FreeParameter> free = parameters_of(model);
    for (std::size_t j = 0; j < free.size(); ++j)
      if (free[j].effect == effect && free[j].index == index) {
        const auto at = static_cast<Eigen::Index>(j);
        return std::sqrt(std::max(model.fit.covariance(at, at), 0.0));
      }
    return 0.0;
  }

  void add(const std::string& name, std::string_view unit, double value, double sigma,
           const std::string& source) {
    IdentifiedParameter p;
    p.name = name;
    p.unit = unit;
    p.value = value;
    p.low = value - 1.96 * sigma;
    p.high = value + 1.96 * sigma;
    p.source = source;
    const double percent = value != 0.0 ? 196.0 * sigma / std::abs(value) : HUGE_VAL;
    p.goodness =
        percent < 99.0 ? text("known to %.2g %%", std::max(percent, 1e-3)) : "no different from zero";
    result_.parameters.push_back(p);
  }

  static const char* source_of(std::string_view kind) {
    if (kind == "viscous_friction") return "speeds at constant voltages; the back-EMF is the plant file's";
    if (kind == "coulomb_friction") return "speeds at constant voltages, coasts";
    if (kind == "stribeck_friction") return "breakaway from ramps, slow motion";
    if (kind == "bristle_friction") return "transitions from rest";
    if (kind == "constant_force") return "difference between the two directions";
    return "decay of the pendulum";
  }

  void report(const Model& model) {
    result_.plant = model.fit.point.plant;
    result_.noise = model.fit.point.noise;
    result_.rms = whitened_rms(model.fit);
    for (const std::size_t effect : model.free) {
      const EffectInfo& info = effect_registry()[effect];
      if (info.enters == Enters::parameter) continue;
      for (std::size_t i = 0; i < info.parameters.size(); ++i)
        add(std::string(info.kind) + "." + std::string(info.parameters[i].name), info.parameters[i].unit,
            result_.plant.find(effect)->values[i], sigma_of(model, effect, i), source_of(info.kind));
    }
    fold_scale(model, "cart_mass", "cart_mass_kg", base_.cart_mass_kg);
    if (base_.pendulum)
      fold_scale(model, "pendulum_length", "pendulum.length_to_com_m", base_.pendulum->length_to_com_m);
    add_breakaway(model);
    drop_zero(model, "constant_force");
  }

  /// Where friction is viscous and Coulomb only, the balance of forces is the better witness: what no model
  /// explains (an asymmetry, a flexibility) stays in the force where it is and does not drift the simulation.
  void use_force_balance() {
    const ForceBalance& b = *result_.balance;
    const auto take = [&](const char* name, double value, double sigma) {
      for (IdentifiedParameter& p : result_.parameters) {
        if (p.name != name) continue;
        p.goodness = text("balance of forces, %.2g %% of the force is left; the fit of the whole says %.5g",
                          100.0 * b.relative_error, p.value);
        p.value = value;
        p.low = value - 1.96 * sigma;
        p.high = value + 1.96 * sigma;
      }
    };
    const double viscous = b.damping_n_per_mps - base_.motor.back_emf_n_per_mps;
    if (!(b.mass_kg > 0.0) || viscous < 0.0 || b.coulomb_n < 0.0) return;
    take("cart_mass_kg", b.mass_kg, b.mass_sigma);
    take("viscous_friction.coefficient_n_per_mps", viscous, b.damping_sigma);
    take("coulomb_friction.force_n", b.coulomb_n, b.coulomb_sigma);
    take("breakaway_n", b.coulomb_n, b.coulomb_sigma);
    take("constant_force.force_n", b.constant_n, b.constant_sigma);
    const double motor = base_.motor.force_per_volt_n * base_.cart_mass_kg / b.mass_kg;
    take("force_per_volt_n_if_the_mass_is_known", motor, motor * b.mass_sigma / b.mass_kg);
    result_.plant.cart_mass_kg = b.mass_kg;
    result_.plant.set("viscous_friction", {viscous});
    result_.plant.set("coulomb_friction", {b.coulomb_n});
    if (std::abs(b.constant_n) > 1.96 * b.constant_sigma) result_.plant.set("constant_force", {b.constant_n});
  }

  /// A scale of the plant file's own number becomes the number.
  void fold_scale(const Model& model, std::string_view kind, const char* name, double given) {
    const std::size_t effect = effect_number(kind);
    const PlantEffect* scale = result_.plant.find(effect);
    if (scale == nullptr) return;
    const double value = scale->values[0], sigma = sigma_of(model, effect, 0);
    const bool mass = kind == "cart_mass";
    add(name, mass ? "kg" : "m", given * value, given * sigma,
        mass ? "accelerations; the motor's force per volt is the plant file's" : "period of the decay");
    if (mass) {
      result_.plant.cart_mass_kg *= value;
      // Forces are known up to one scale: believing the mass instead of the motor turns it round.
      const double motor = base_.motor.force_per_volt_n / value;
      add("force_per_volt_n_if_the_mass_is_known", "N/V", motor, motor * sigma / value,
          "accelerations; every force scales with it");
    } else {
      Pendulum& pendulum = *result_.plant.pendulum;
      pendulum.length_to_com_m *= value;
      if (pendulum.given_inertia_kgm2) *pendulum.given_inertia_kgm2 *= value * value;
    }
    result_.plant.remove(effect);
  }

  /// What must be overcome at rest: Coulomb and Stribeck together.
  void add_breakaway(const Model& model) {
    const PlantEffect* coulomb = result_.plant.find("coulomb_friction");
    const PlantEffect* stribeck = result_.plant.find("stribeck_friction");
    if (coulomb == nullptr) return;
    double value = coulomb->values[0];
    double variance = std::pow(sigma_of(model, coulomb->number, 0), 2);
    if (stribeck != nullptr) {
      value += stribeck->values[0];
      variance += std::pow(sigma_of(model, stribeck->number, 0), 2);
      const std::vector<FreeParameter> free = parameters_of(model);
      for (std::size_t i = 0; i < free.size(); ++i)
        for (std::size_t j = 0; j < free.size(); ++j)
          if (free[i].effect == coulomb->number && free[j].effect == stribeck->number && free[j].index == 0)
            variance +=
                2.0 * model.fit.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
    double read = 0.0;
    for (const Breakaway& b : result_.breakaways)
      read += std::abs(b.force_n) / static_cast<double>(result_.breakaways.size());
    add("breakaway_n", "N", value, std::sqrt(std::max(variance, 0.0)), "breakaway from ramps");
    if (!result_.breakaways.empty())
      result_.parameters.back().goodness +=
          text("; %.0f ramps read %.4g N", static_cast<double>(result_.breakaways.size()), read);
  }

  /// A bias whose interval holds zero is not in the plant.
  void drop_zero(const Model& model, std::string_view kind) {
    const std::size_t effect = effect_number(kind);
    const PlantEffect* have = result_.plant.find(effect);
    if (have != nullptr && std::abs(have->values[0]) < 1.96 * sigma_of(model, effect, 0))
      result_.plant.remove(effect);
  }

  const SelectionPolicy policy_;
  const SearchBudget budget_{};
  Plant base_;
  std::vector<std::size_t> order_;  ///< place among the runs as given, for each of `runs_`
  std::vector<Measurement> runs_;
  const IdentificationOptions& options_;
  DataRange range_;
  FitData whole_, trial_, few_;
  Model so_far_;  ///< the best that was fitted
  Identification result_;
};

}  // namespace

Identification identify(const Plant& base, const std::vector<Measurement>& runs,
                        const IdentificationOptions& options) {
  const InterruptibleWork watch(options.signal);
  return Identifier(base, runs, options).run();
}

}  // namespace upright
