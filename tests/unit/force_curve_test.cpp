// What innovations say of a force that is a curve over the place.
#include "estimation/force_curve.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "blind_case.hpp"
#include "estimation/random_curve.hpp"

namespace upright {
namespace {

Plant cart_and_pendulum() {
  Plant plant;
  plant.cart_mass_kg = 1.0;
  plant.motor = {1.5, 6.6};
  plant.pendulum = Pendulum{0.2, 0.3, {}};
  plant.set("viscous_friction", {2.8});
  return plant;
}

struct Record {
  std::vector<Measurement> runs;
  FitData data;

  explicit Record(const Plant& truth) {
    blind::Rig rig{.plant = truth};
    rig.cart_step_m = 2e-6;
    blind::Plan plan;
    plan.experiment = blind::Experiment::multisine;
    plan.rate_hz = 250.0;
    plan.duration_s = 12.0;
    runs.push_back(measure(rig, plan, "run"));
    data = {&runs, cut_segments(runs)};
  }

  FitPoint start(const Plant& plant) const {
    return {plant, estimate_initial_states(runs, data.segments, plant), {.force = 0.02}};
  }

  /// Over the places that the cart was at.
  CurveNodes nodes(std::size_t count) const {
    const auto [low, high] = std::minmax_element(runs[0].cart_m.begin(), runs[0].cart_m.end());
    return {*low, (*high - *low) / static_cast<double>(count - 1), count};
  }

  /// Of a curve over the place.
  CurveEquations equations(const FitPoint& point, const CurveNodes& over) const {
    return curve_equations(linearise(data, point), over, shown_places(data));
  }
};

/// The same force everywhere is the effect `constant_force`, whose derivatives the fit has by itself.
TEST(ForceCurve, ThatIsFlatIsTheConstantForce) {
  Plant plant = cart_and_pendulum();
  const Record record(plant);
  plant.set("constant_force", {0.0});
  const std::vector<FreeParameter> free = {{effect_number("constant_force"), 0, -10.0, 10.0, 1.0}};
  FitOptions held;
  held.noise_rounds = 0;
  const FitResult fitted = fit(record.data, record.start(plant), free, held);
  const CurveEquations places = record.equations(fitted.point, record.nodes(20));
  EXPECT_NEAR(places.information.sum() / fitted.information(0, 0), 1.0, 2e-3);
  EXPECT_NEAR(places.score.sum(), 0.0, 0.05 * std::sqrt(fitted.information(0, 0)));
}

TEST(ForceCurve, IsRecoveredFromTheInnovations) {
  Plant truth = cart_and_pendulum();
  constexpr double amplitude_n = 0.2, pitch_m = 0.1;
  truth.set("cogging_force", {amplitude_n, pitch_m, 0.0});
  const Record record(truth);
  const FitPoint without = record.start(cart_and_pendulum());
  FitOptions held;
  held.noise_rounds = 0;
  const FitResult followed = fit(record.data, without, {}, held);
  constexpr Eigen::Index count = 30;
  const CurveNodes nodes = record.nodes(count);
  const CurveEquations places = record.equations(followed.point, nodes);
  const Eigen::MatrixXd prior = Eigen::MatrixXd::Identity(count, count) / (amplitude_n * amplitude_n);
  const Eigen::VectorXd force_n = (places.information + prior).ldlt().solve(places.score);
  double error = 0.0, size = 0.0;
  for (Eigen::Index i = 3; i < count - 3; ++i) {  // the ends were hardly visited
    const double x_m = nodes.first + nodes.spacing * static_cast<double>(i);
    const double expected_n = amplitude_n * std::sin(2.0 * M_PI * x_m / pitch_m);
    error += std::pow(force_n[i] - expected_n, 2);
    size += std::pow(expected_n, 2);
  }
  EXPECT_LT(error, 0.1 * size);
}

/// A curve that differs from node to node has as many values as nodes where each is known well, and none
/// where the data say nothing of it.
TEST(RandomCurve, HasAsManyValuesAsTheDataShow) {
  constexpr Eigen::Index count = 8;
  const CurveNodes nodes{0.0, 0.1, count};
  Eigen::VectorXd values(count);
  values << 1.0, -1.0, 0.5, -1.5, 1.0, 1.2, -0.8, -0.4;
  const auto known_to = [&](double information) {
    return CurveEquations{information * Eigen::MatrixXd::Identity(count, count), information * values};
  };
  const RandomCurve curve(known_to(1e4), nodes);
  ASSERT_TRUE(curve.is_there());
  EXPECT_NEAR(curve.effective_values(known_to(1e4)), 8.0, 0.1);
  EXPECT_LT(curve.effective_values(known_to(1e-4)), 0.1);
}

}  // namespace
}  // namespace upright
