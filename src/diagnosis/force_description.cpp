#include "force_description.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <vector>

#include "estimation/random_curve.hpp"
#include "estimation/smoother.hpp"
#include "force_formula.hpp"
#include "upright/model/effects/force_table.hpp"
#include "without_effect.hpp"

namespace upright {

namespace {

using Table = effects::ForceTable;
constexpr double unbounded = std::numeric_limits<double>::infinity();

/// What a force table depends on, for people.
constexpr std::array<std::string_view, Table::over_count> quantity_names = {
    "the velocity", "the position", "the position, as dry friction", "the position, times the velocity"};

/// How a table of this kind acts along a trace.
CurveArgument argument_along(const ResidualTrace& trace, Table::Over over) {
  CurveArgument argument;
  if (over == Table::velocity) {
    argument.at = trace.cart_mps;
    return argument;
  }
  argument.at = trace.cart_m;
  if (over == Table::position) return argument;
  for (const double v : trace.cart_mps)
    argument.factor.push_back(over == Table::position_and_velocity ? -v : (v > 0.0 ? -1.0 : 1.0));
  return argument;
}

/// Nodes over all but the most extreme values, which single samples reach.
CurveNodes table_nodes(const std::vector<CurveArgument>& arguments) {
  std::vector<double> values;
  for (const CurveArgument& segment : arguments)
    values.insert(values.end(), segment.at.begin(), segment.at.end());
  constexpr double beyond = 0.001;  // share of the samples on each side
  const auto last = static_cast<double>(values.size()) - 1.0;
  const auto at = [&](double share) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * last);
    std::nth_element(values.begin(), place, values.end());
    return *place;
  };
  if (values.empty()) return {};
  const double low = at(beyond), high = at(1.0 - beyond);
  if (!(high > low)) return {};
  return {low, (high - low) / static_cast<double>(Table::node_count - 1), Table::node_count};
}

/// A curve over one quantity, as the innovations of a fit show it.
struct Curve {
  Table::Over over = Table::velocity;
  CurveNodes nodes;
  double evidence = 0.0;
  Eigen::VectorXd force_n;            ///< at the nodes
  Eigen::MatrixXd prior_information;  ///< of the forces at the nodes
};

/// Curves over each quantity, the one with the most evidence first. `traces`: of the training segments.
std::vector<Curve> curves_of(const FitData& train, const FitPoint& point,
                             const std::vector<ResidualTrace>& traces) {
  const std::vector<std::vector<LinearStep>> steps = linearise(train, point);
  std::vector<Curve> curves;
  for (int number = 0; number < Table::over_count; ++number) {
    const auto over = static_cast<Table::Over>(number);
    std::vector<CurveArgument> arguments;
    for (const ResidualTrace& trace : traces) {
      const Measurement& run = (*train.runs)[trace.run];
      const bool acts = run.has_cart() && !run.cart_locked;
      arguments.push_back(acts ? argument_along(trace, over) : CurveArgument{});
    }
    const CurveNodes nodes = table_nodes(arguments);
    if (nodes.count == 0) continue;
    const CurveEquations equations = curve_equations(steps, nodes, arguments);
    const RandomCurve curve(equations, nodes);
    if (!curve.is_there()) continue;
    curves.push_back({over, nodes, -curve.change(), curve.mean(equations), curve.prior_information()});
  }
  std::stable_sort(curves.begin(), curves.end(),
                   [](const Curve& a, const Curve& b) { return a.evidence > b.evidence; });
  return curves;
}

Plant with_table(Plant plant, const Curve& curve) {
  const double last = curve.nodes.first + curve.nodes.spacing * static_cast<double>(curve.nodes.count - 1);
  std::vector<double> values = {static_cast<double>(curve.over), curve.nodes.first, last};
  for (const double force_n : curve.force_n)
    values.push_back(curve.over == Table::position_and_direction ? std::max(force_n, 0.0) : force_n);
  plant.set(effect_index<Table>(), values);
  return plant;
}

/// The values at the nodes, and the parameters of the effects that were found. Where these are too many for a
/// fit, and for the numbers of the plant file, the values of `h` stand.
std::vector<FreeParameter> free_beside(const Search& search, const Hypothesis& h, const Curve& curve) {
  std::vector<FreeParameter> free;
  for (const FreeParameter& p : h.free)
    if (!search.is_nuisance(p.effect)) free.push_back(p);
  if (free.size() + Table::node_count > max_free_parameters) free.clear();
  const double scale_n = std::max(curve.force_n.cwiseAbs().maxCoeff(), 1e-9);
  const double low_n = curve.over == Table::position_and_direction ? 0.0 : -unbounded;
  for (std::size_t i = 0; i < Table::node_count; ++i)
    free.push_back({effect_index<Table>(), Table::first_node + i, low_n, unbounded, scale_n});
  return free;
}

/// The nodes come last among the free parameters.
GaussianPrior prior_of(const std::vector<FreeParameter>& free, const Curve& curve) {
  const auto n = static_cast<Eigen::Index>(free.size());
  const auto nodes = static_cast<Eigen::Index>(Table::node_count);
  GaussianPrior prior{Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)};
  for (Eigen::Index j = 0; j < n - nodes; ++j) {
    const FreeParameter& p = free[static_cast<std::size_t>(j)];
    prior.mean[j] = p.prior_mean;
    if (p.prior_sigma > 0.0) prior.information(j, j) = 1.0 / (p.prior_sigma * p.prior_sigma);
  }
  prior.information.bottomRightCorner(nodes, nodes) = curve.prior_information;
  return prior;
}

/// Fits the data with the curve, the noise too.
FitResult fit_with_curve(const FitData& data, const FitPoint& start, const std::vector<FreeParameter>& free,
                         const Curve& curve) {
  FitOptions options;
  options.joint_prior = prior_of(free, curve);
  options.alternative_noise = reduced_process_noise(start.noise);
  return fit(data, start, free, options);
}

std::string sentence_of(const std::vector<Curve>& curves) {
  std::ostringstream text;
  text.precision(3);
  text << "a curve over " << quantity_names[curves.front().over] << " (evidence " << curves.front().evidence;
  if (curves.size() > 1)
    text << "; the next best, over " << quantity_names[curves[1].over] << ", has " << curves[1].evidence;
  text << ")";
  return text.str();
}

/// The curve of a fit as a formula; empty if none fits it.
std::optional<ForceFormula> formula_of_fit(const FitResult& fitted, const Curve& curve) {
  const auto nodes = static_cast<Eigen::Index>(Table::node_count);
  const auto& values = fitted.point.plant.find(effect_index<Table>())->values;
  const Eigen::VectorXd force_n = Eigen::Map<const Eigen::VectorXd>(&values[Table::first_node], nodes);
  return formula_of(curve.nodes, force_n, fitted.covariance.bottomRightCorner(nodes, nodes));
}

/// Whether effects of the registry have this force: a constant force, viscous friction, quadratic drag, a
/// spring, Coulomb friction and its slope along the track. The search knows them, and did not name them.
bool is_known(const ForceFormula& formula, Table::Over over) {
  const Term last = over == Table::velocity                ? Term::square
                    : over == Table::position_and_velocity ? Term::one
                                                           : Term::linear;
  return std::all_of(formula.terms.begin(), formula.terms.end(), [&](Term term) { return term <= last; });
}

}  // namespace

bool ForceDescription::moved(std::size_t effect) const {
  return std::any_of(known.free.begin(), known.free.end(),
                     [&](const FreeParameter& p) { return p.effect == effect; });
}

std::string ForceDescription::left_sentence(double factor) const {
  std::ostringstream text;
  text.precision(3);
  text << "a force is left that no effect describes: with it as " << where
       << " the error on held-out data is " << factor << " times smaller";
  return text.str();
}

FoundEffect ForceDescription::as_effect(double gap_before, double gap_after) const {
  FoundEffect found;
  found.effect = effect_index<Table>();
  found.gap_before = gap_before;
  found.gap_after = gap_after;
  found.parameters = estimates_of(found.effect, known);
  found.where = where;
  return found;
}

std::optional<ForceDescription> describe_force(const Search& search, const Hypothesis& judged,
                                               const Hypothesis& known) {
  const FitData& train = search.train_data();
  const FitData all = search.all_data();
  if (!search.range().cart_moves || search.held_data().segments.empty()) return std::nullopt;
  if (search.given().find(effect_index<Table>()) != nullptr) return std::nullopt;
  if (known.train.point.starts.size() != all.segments.size()) return std::nullopt;
  const std::vector<ResidualTrace> traces =
      smooth_residuals(train, judged.train.point, search.policy().location.walk);
  const std::vector<Curve> curves = curves_of(train, judged.train.point, traces);
  if (curves.empty() || !(curves.front().evidence > search.policy().acceptance.min_evidence))
    return std::nullopt;
  const Curve& curve = curves.front();

  ForceDescription result{judged, known, unbounded, sentence_of(curves)};
  result.judged.simulation.reset();
  result.judged.free = result.known.free = free_beside(search, judged, curve);
  result.judged.train =
      fit_with_curve(train, moved_to(judged.train.point, with_table(judged.train.point.plant, curve)),
                     result.judged.free, curve);
  if (!std::isfinite(result.judged.train.objective)) return std::nullopt;
  const std::optional<ForceFormula> formula = formula_of_fit(result.judged.train, curve);
  if (formula && is_known(*formula, curve.over)) return std::nullopt;
  search.filter_held_out(result.judged, sensors_only(result.judged.train.point.noise));
  result.held_out_error = search.gap_of(result.judged);
  Plant plant = known.train.point.plant;
  plant.set(effect_index<Table>(), result.judged.train.point.plant.find(effect_index<Table>())->values);
  result.known.train = fit_with_curve(all, moved_to(known.train.point, plant), result.known.free, curve);
  if (!std::isfinite(result.known.train.objective)) return std::nullopt;
  const bool of_velocity = curve.over == Table::velocity;
  if (formula)
    result.where +=
        "; within its uncertainty it is " + formula->text(of_velocity ? "v" : "x", of_velocity ? "m/s" : "m");
  return result;
}

}  // namespace upright
