// What makes an answer one to trust: parts of the data that agree, the power of the data, numbers that moved.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <set>

#include "blind_case.hpp"
#include "diagnosis/base_numbers.hpp"
#include "diagnosis/detectable.hpp"
#include "diagnosis/listing.hpp"
#include "diagnosis/phases.hpp"
#include "diagnosis/reproducibility.hpp"
#include "diagnosis/validation.hpp"
#include "estimation/held_out.hpp"

namespace upright {
namespace {

const std::size_t force = effect_number("constant_force");
const std::size_t cart_mass = effect_number("cart_mass");

Plant file_plant() {
  Plant plant;
  plant.cart_mass_kg = 0.8;
  plant.motor = {1.7, 7.7};
  plant.set("viscous_friction", {3.0});
  return plant;
}

Measurement run_of(const blind::Rig& rig, double duration_s, unsigned seed, double amplitude_v = 2.0) {
  blind::Plan plan;
  plan.rate_hz = 200.0;
  plan.duration_s = duration_s;
  plan.amplitude_v = amplitude_v;
  plan.seed = seed;
  return measure(rig, plan, "run" + std::to_string(seed));
}

/// One run of the rig of the file with a constant force beside it.
Measurement run_with(double force_n, unsigned seed, double amplitude_v = 2.0, double load_kg = 0.0) {
  blind::Rig rig{.plant = file_plant()};
  rig.plant.cart_mass_kg += load_kg;
  if (force_n != 0.0) rig.plant.set("constant_force", {force_n});
  return run_of(rig, 6.0, seed, amplitude_v);
}

/// The first run is fitted, the others are held out.
void hold_out_all_but_first(const std::vector<Measurement>& runs, FitData& train, FitData& held) {
  for (const Segment& segment : cut_segments(runs))
    (segment.run == 0 ? train : held).segments.push_back(segment);
}

/// Two runs, the first fitted and the second held out, with a constant force in the model of both, and
/// perhaps corrections of numbers of the plant file.
class Fitted {
 public:
  explicit Fitted(std::vector<Measurement> runs, std::vector<std::size_t> corrections = {})
      : runs_(std::move(runs)), corrections_(std::move(corrections)), train_{&runs_, {}}, held_{&runs_, {}} {
    hold_out_all_but_first(runs_, train_, held_);
    search_.emplace(file_plant(), runs_, train_, held_, policy_, budget_);
    Hypothesis base = search_->baseline();
    base.train.point.plant.set(force, std::vector<double>{0.1});
    std::vector<std::size_t> in_model = {force};
    in_model.insert(in_model.end(), corrections_.begin(), corrections_.end());
    final_ = search_->fitted_separately(in_model, base, nullptr, true);
    search_->filter_held_out(final_, final_.train.point.noise);
    known_ = search_->fitted_to_all_runs(final_);
  }
  Reproduction reproduction() const { return reproduce(*search_, known_, {force}).front(); }
  bool is_contradicted() const { return upright::is_contradicted(reproduction(), policy_.significance); }
  Listing listing() {
    return list_effects(*search_, final_, {.effects = {force}, .corrections = corrections_});
  }
  /// Of the corrections alone.
  Listing listing_of_corrections() {
    return list_effects(*search_, final_, {.effects = corrections_, .corrections = corrections_});
  }
  double fitted_mass_scale() const { return final_.train.point.plant.find(cart_mass)->values[0]; }

 private:
  const SelectionPolicy policy_;
  const SearchBudget budget_;
  std::vector<Measurement> runs_;
  std::vector<std::size_t> corrections_;
  FitData train_, held_;
  std::optional<Search> search_;
  Hypothesis final_, known_;
};

TEST(Reproducibility, OfAForceThatBothRunsHave) {
  const Fitted fitted({run_with(0.3, 1), run_with(0.3, 2)});
  const Reproduction r = fitted.reproduction();
  EXPECT_FALSE(fitted.is_contradicted()) << r.where;
  EXPECT_GT(r.transferred_evidence, 25.0);
  ASSERT_EQ(r.runs.size(), 2u);
  for (const RunEvidence& of : r.runs) EXPECT_GT(of.evidence, 25.0);
  EXPECT_GT(r.shows_most.evidence, 0.0);
  EXPECT_NEAR(r.shows_most.to_s - r.shows_most.from_s, 0.2, 0.006);
}

TEST(Reproducibility, OfAForceThatIsOfAnotherSizeElsewhere) {
  EXPECT_FALSE(Fitted({run_with(0.3, 1), run_with(0.2, 2)}).is_contradicted());
}

TEST(Reproducibility, IsMissingWhereTheForceIsReversed) {
  const Fitted fitted({run_with(0.4, 1), run_with(-0.2, 2)});
  EXPECT_TRUE(fitted.is_contradicted()) << fitted.reproduction().where;
}

TEST(Reproducibility, IsMissingWhereOneRunHasNoSuchForce) {
  const Fitted fitted({run_with(0.4, 1), run_with(0.0, 2)});
  EXPECT_TRUE(fitted.is_contradicted()) << fitted.reproduction().where;
}

TEST(Listing, LowersTheErrorOfTheHeldOutRun) {
  const Listing listing = Fitted({run_with(0.3, 1), run_with(0.3, 2)}).listing();
  EXPECT_FALSE(listing.raises);
  EXPECT_LT(listing.after, 0.5 * listing.before);
}

TEST(Listing, NamesAnEffectThatRaisesTheError) {
  const Listing listing = Fitted({run_with(0.4, 1), run_with(-0.4, 2)}).listing();
  EXPECT_EQ(listing.raises, force);
  for (const Listing::Row& row : listing.rows) EXPECT_LE(row.after, row.before);
}

TEST(Listing, NamesANumberOfThePlantFileThatIsBetterAsGiven) {
  constexpr double load_kg = 0.2;
  Fitted fitted({run_with(0.3, 1, 2.0, load_kg), run_with(0.3, 2)});
  EXPECT_GT(fitted.fitted_mass_scale(), 1.1);
  const Listing listing = fitted.listing();
  EXPECT_EQ(listing.number_raises, cart_mass);
  EXPECT_FALSE(listing.raises) << "the number goes back first";
  EXPECT_FALSE(
      Fitted({run_with(0.3, 1, 2.0, load_kg), run_with(0.3, 2, 2.0, load_kg)}).listing().number_raises);
}

/// A mass 2.5 percent off is within what is believed of it, one 25 percent off is not.
TEST(Listing, KeepsACorrectionWithinWhatIsBelievedOfTheNumber) {
  for (const double load_kg : {0.02, 0.2}) {
    Fitted fitted({run_with(0.3, 1, 2.0, load_kg), run_with(0.3, 2)}, {cart_mass});
    EXPECT_NEAR(fitted.fitted_mass_scale(), 1.0 + load_kg / 0.8, 0.005);
    EXPECT_EQ(fitted.listing().number_raises.has_value(), load_kg > 0.1);
  }
}

/// The cart of the held-out run is lighter than in the file, that of the other run heavier.
TEST(Listing, BlamesNoCorrectionWithinWhatIsBelievedForARise) {
  const Listing listing = Fitted({run_with(0.0, 1, 2.0, 0.035), run_with(0.0, 2, 2.0, -0.035)}, {cart_mass})
                              .listing_of_corrections();
  EXPECT_FALSE(listing.raises);
  EXPECT_FALSE(listing.number_raises);
}

/// One run has bristles and a spring, the held-out one only bristles. Without the spring, softer bristles
/// hold the cart of the first run.
TEST(Listing, BlamesNoEffectWithoutWhichAnotherIsImpossible) {
  blind::Rig rig{.plant = file_plant()};
  rig.plant.set("coulomb_friction", {0.5});
  rig.plant.set("bristle_friction", {400.0, 10.0});
  blind::Rig with_spring = rig;
  with_spring.plant.set("cable_spring", {6.0, 0.0});
  const std::vector<Measurement> runs = {run_of(with_spring, 24.0, 1), run_of(rig, 24.0, 2)};
  FitData train{&runs, {}}, held{&runs, {}};
  hold_out_all_but_first(runs, train, held);
  const std::size_t spring = effect_number("cable_spring");
  const std::vector<std::size_t> effects = {effect_number("coulomb_friction"),
                                            effect_number("bristle_friction"), spring};
  // What the simulation speaks against, if bristles may bend over this share of the travel.
  const auto raises = [&](double longest_bristles) {
    SelectionPolicy policy;
    policy.prior.bristle_share_of_travel = longest_bristles;
    const SearchBudget budget;
    Search search(file_plant(), runs, train, held, policy, budget);
    Hypothesis base = search.baseline();
    base.train.point.plant = with_spring.plant;
    const Hypothesis judged = search.fitted_separately(effects, base, nullptr, true);
    return list_effects(search, judged, {.effects = effects, .corrections = {}}).raises;
  };
  EXPECT_EQ(raises(0.1), spring);
  EXPECT_FALSE(raises(0.03));
}

TEST(Halves, TakeEverySecondSegmentOfOneRun) {
  const std::vector<Measurement> runs = {run_with(0.0, 1)};
  const FitData data{&runs, cut_segments(runs)};
  const auto [first, second] = halves(data, 0.3, 0.02);
  ASSERT_EQ(first.size() + second.size(), data.segments.size());
  for (const std::size_t place : first) EXPECT_EQ(place % 2, 0u);
  for (const std::size_t place : second) EXPECT_EQ(place % 2, 1u);
}

TEST(Halves, DoNotDependOnTheOrderOfRuns) {
  const std::vector<Measurement> runs = {run_with(0.0, 1, 0.5), run_with(0.0, 2, 1.0), run_with(0.0, 3, 2.0)};
  const std::vector<Measurement> turned = {runs[2], runs[1], runs[0]};
  const auto names = [](const std::vector<Measurement>& of) {
    const FitData data{&of, cut_segments(of)};
    std::set<std::string> first;
    const auto parts = halves(data, 0.3, 0.02);
    for (const std::size_t place : parts[0]) first.insert(of[data.segments[place].run].name);
    return first;
  };
  EXPECT_EQ(names(runs), (std::set<std::string>{"run1", "run3"}));
  EXPECT_EQ(names(turned), names(runs));
}

/// Bristles of 5 mm in a travel of 30 cm, and in one of 2 cm whether or not another run is far away.
TEST(Bristles, AreComparedWithTheTravelOfOneRun) {
  const auto are_admissible = [](double amplitude_m, double apart_m) {
    std::vector<Measurement> runs(2);
    for (std::size_t r = 0; r < 2; ++r)
      for (int k = 0; k < 200; ++k) {
        const double t = 0.01 * k;
        runs[r].time_s.push_back(t);
        runs[r].voltage_v.push_back(0.0);
        runs[r].cart_m.push_back(amplitude_m * std::sin(6.0 * t) + apart_m * static_cast<double>(r));
      }
    const FitData train{&runs, cut_segments(runs)};
    const SelectionPolicy policy;
    const SearchBudget budget;
    const Search search(file_plant(), runs, train, {&runs, {}}, policy, budget);
    Hypothesis h;
    h.train.point.plant = file_plant();
    h.train.point.plant.set("coulomb_friction", {0.5});
    h.train.point.plant.set("bristle_friction", {100.0, 0.0});
    return search.is_admissible(h, effect_number("bristle_friction"));
  };
  EXPECT_TRUE(are_admissible(0.15, 0.0));
  EXPECT_FALSE(are_admissible(0.01, 0.0));
  EXPECT_FALSE(are_admissible(0.01, 0.5));
}

TEST(Pitch, IsShownByOneRunNotByPlacesFarApart) {
  Measurement here, far;
  for (int k = 0; k < 200; ++k) {
    const double t = 0.01 * k, x = 0.03 * std::sin(3.0 * t);
    for (Measurement* run : {&here, &far}) {
      run->time_s.push_back(t);
      run->voltage_v.push_back(0.0);
      run->cart_m.push_back(run == &far ? x + 0.5 : x);
    }
  }
  const SelectionPolicy policy;
  const auto longest_pitch = [&](const std::vector<Measurement>& runs) {
    const DataRange range = range_of(runs, file_plant(), policy.excitation);
    return free_parameters(effect_number("cogging_force"), range, policy.prior)[1].high;
  };
  EXPECT_DOUBLE_EQ(longest_pitch({here, far}), longest_pitch({here}));
  EXPECT_NEAR(longest_pitch({here}), 0.06 / policy.prior.crests_of_pitch, 1e-4);
}

TEST(AngleStep, IsThatOfAnEncoderAsPreciseAsTheSensor) {
  const auto step_of = [](double encoder_step_rad, double noise_rad) {
    Measurement run;
    std::mt19937_64 random(1);
    std::normal_distribution<double> noise(0.0, noise_rad);
    for (int k = 0; k < 2000; ++k) {
      const double t = 0.005 * k, theta = 0.3 * std::sin(4.0 * t) + (noise_rad > 0.0 ? noise(random) : 0.0);
      run.time_s.push_back(t);
      run.voltage_v.push_back(0.0);
      run.theta_rad.push_back(encoder_step_rad > 0.0 ? encoder_step_rad * std::round(theta / encoder_step_rad)
                                                     : theta);
    }
    run.theta_resolution_rad = encoder_step_rad;
    return range_of({run}, file_plant(), SelectionPolicy{}.excitation).theta_step_rad;
  };
  EXPECT_NEAR(step_of(2e-3, 0.0), 2e-3, 1e-12);
  EXPECT_NEAR(step_of(0.0, 1e-3), std::sqrt(12.0) * 1e-3, 2e-4);
}

TEST(Phase, IsWithinHalfATurn) {
  constexpr double pi = std::numbers::pi;
  EXPECT_DOUBLE_EQ(wrapped_phase(-pi), pi);
  EXPECT_NEAR(wrapped_phase(25.0), 25.0 - 8.0 * pi, 1e-12);
  EXPECT_DOUBLE_EQ(wrapped_phase(1.0), 1.0);
  Plant plant = file_plant();
  plant.set("cogging_force", {0.3, 0.01, -7.0});
  wrap_phases(plant);
  EXPECT_NEAR(plant.find("cogging_force")->values[2], 2.0 * pi - 7.0, 1e-12);
  EXPECT_EQ(plant.find("cogging_force")->values[1], 0.01);
}

/// Three runs of a cart that cogs, so far from the zero of its encoder.
Diagnosis of_cogging_cart(double far_m) {
  blind::Rig rig{.plant = file_plant()};
  rig.plant.set("cogging_force", {0.5, 0.011, 0.3});
  std::vector<Measurement> runs;
  for (const unsigned seed : {1u, 2u, 3u}) {
    blind::Plan plan;
    plan.rate_hz = 200.0;
    plan.duration_s = 6.0;
    plan.seed = seed;
    runs.push_back(measure(rig, plan, "run" + std::to_string(seed)));
    for (double& cart_m : runs.back().cart_m) cart_m += far_m;
  }
  return diagnose(file_plant(), runs, {});
}

TEST(Phase, OpenAtTheZeroOfTheCartIsNotNamed) {
  const Diagnosis near = of_cogging_cart(0.0);
  ASSERT_EQ(near.effects.size(), 1u);
  EXPECT_EQ(kind_of(near.effects[0].effect), "cogging_force");
  EXPECT_FALSE(is_phase_open(near.effects[0].parameters));
  const Diagnosis far = of_cogging_cart(1000.0);  // these data fix the pitch well
  EXPECT_TRUE(far.effects.empty());
  ASSERT_EQ(far.helps_here_only.size(), 1u);
  EXPECT_EQ(kind_of(far.helps_here_only[0].effect), "cogging_force");
  EXPECT_TRUE(is_phase_open(far.helps_here_only[0].parameters));
  EXPECT_EQ(far.model.find("cogging_force"), nullptr);
}

TEST(Power, GrowsWithTheParametersThatHaveToBePaidFor) {
  const SelectionPolicy policy;
  const double of_95_percent = 1.6448536269514722;  // the quantile of a Gaussian
  const double one = standard_errors_to_be_shown(force, false, policy);
  EXPECT_DOUBLE_EQ(one, std::sqrt(policy.acceptance.min_evidence) + of_95_percent);
  EXPECT_GT(standard_errors_to_be_shown(effect_number("cogging_force"), false, policy), one);
  EXPECT_DOUBLE_EQ(standard_errors_to_be_shown(effect_number("cart_mass"), true, policy),
                   policy.significance.certain_z + of_95_percent);
}

TEST(Power, LetsHideOnlyTheFrictionThatThePlantLacks) {
  const auto detectable = [](const char* kind, double size) {
    return Detectable{effect_number(kind), size, 1.0, {}};
  };
  const std::vector<Detectable> sizes = {
      detectable("viscous_friction", 2.0), detectable("coulomb_friction", 2.0),
      detectable("pivot_coulomb_friction", 0.5), detectable("input_delay", 2.0)};
  const std::vector<Detectable> hidden = may_hide(sizes, file_plant(), {});
  ASSERT_EQ(hidden.size(), 1u);
  EXPECT_EQ(kind_of(hidden[0].effect), "coulomb_friction");
}

TEST(MovedNumbers, AreThoseOfTheFileThatTheModelHasOtherwise) {
  const Plant given = file_plant();
  Plant model = given;
  model.set("cart_mass", {1.2});
  model.set("viscous_friction", {3.2});
  model.motor.back_emf_n_per_mps *= 1.0005;
  const std::vector<MovedNumber> moved = moved_numbers(given, model, {}, {});
  ASSERT_EQ(moved.size(), 2u);
  EXPECT_EQ(moved[0].name, "cart_mass_kg");
  EXPECT_DOUBLE_EQ(moved[0].fitted, 0.96);
  EXPECT_NEAR(moved[0].high, 0.8 * (1.0 + 1.96 * PriorPolicy{}.base_parameter), 1e-12);
  EXPECT_EQ(moved[1].name, "viscous_friction.coefficient_n_per_mps");
  EXPECT_DOUBLE_EQ(moved[1].fitted, 3.2);
}

TEST(Validation, SaysWhichModelIsFurtherOff) {
  Diagnosis right, wrong;
  right.model = wrong.model = file_plant();
  right.model.set("constant_force", {0.3});
  wrong.model.set("constant_force", {-0.3});
  const std::vector<Measurement> runs = {run_with(0.3, 5)};
  const ValidatedRun better = validate(file_plant(), right, runs).front();
  EXPECT_FALSE(better.is_worse());
  EXPECT_LT(better.found.cart_rmse_m, 0.1 * better.given.cart_rmse_m);
  EXPECT_GE(better.found.gap, 1.0);
  EXPECT_TRUE(std::isnan(better.found.theta_rmse_rad));
  EXPECT_TRUE(validate(file_plant(), wrong, runs).front().is_worse());
}

}  // namespace
}  // namespace upright
