#include "force_description.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <vector>

#include "candidates.hpp"
#include "estimation/random_curve.hpp"
#include "estimation/smoother.hpp"
#include "force_formula.hpp"
#include "model/dense_algebra.hpp"
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
CurveNodes nodes_along(const std::vector<CurveArgument>& arguments, std::size_t count) {
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
  return {low, (high - low) / static_cast<double>(count - 1), count};
}

/// The nodes of a table. A table is constant beyond its ends. A curve over the position would push with the
/// force of the last place everywhere else, so its table goes on beside the data, by one node or until the
/// curve is forgotten, and ends at its level. A smooth curve is not forgotten soon; the margin stays a small
/// part of the table.
CurveNodes table_nodes(const std::vector<CurveArgument>& along, Table::Over over, double length,
                       const CurvePolicy& policy) {
  CurveNodes nodes = nodes_along(along, Table::node_count);
  if (over == Table::velocity || nodes.count == 0) return nodes;
  const auto intervals = static_cast<double>(nodes.count - 1);
  const double travel = nodes.spacing * intervals;
  const double one_node = travel / (intervals - 2.0);
  const double margin =
      std::max(std::min(policy.forgotten_lengths * length, policy.largest_margin * travel), one_node);
  return {nodes.first - margin, (travel + 2.0 * margin) / intervals, nodes.count};
}

/// What known effects make of a curve at q: a constant force, viscous friction, quadratic drag, Coulomb
/// friction and the asymmetry of the viscous one; a spring; Coulomb friction and its slope along the track.
std::vector<double> known_terms(Table::Over over, double q) {
  if (over == Table::velocity) return {1.0, q, q * std::abs(q), std::abs(q), q > 0.0 ? 1.0 : -1.0};
  if (over == Table::position_and_velocity) return {1.0};
  return {1.0, q};
}

/// The equations without what known effects may account for, which the search did not name: eliminated by the
/// Schur complement.
CurveEquations beyond_known(const CurveEquations& equations, const CurveNodes& nodes, Table::Over over) {
  const auto rows = static_cast<Eigen::Index>(nodes.count);
  Eigen::MatrixXd terms(rows, static_cast<Eigen::Index>(known_terms(over, 0.0).size()));
  for (Eigen::Index i = 0; i < rows; ++i) {
    const std::vector<double> row = known_terms(over, nodes.first + nodes.spacing * static_cast<double>(i));
    for (Eigen::Index j = 0; j < terms.cols(); ++j) terms(i, j) = row[static_cast<std::size_t>(j)];
  }
  const Eigen::MatrixXd coupled = equations.information * terms;
  Eigen::MatrixXd right(terms.cols(), rows + 1);
  right << coupled.transpose(), terms.transpose() * equations.score;
  const Eigen::MatrixXd both = least_squares(terms.transpose() * coupled, right);
  return {equations.information - coupled * both.leftCols(rows), equations.score - coupled * both.col(rows)};
}

/// The data that a curve is found in: the segments of a fit, linearised, and their motion.
struct Followed {
  const FitData& data;
  std::vector<ResidualTrace> traces;
  std::vector<std::vector<LinearStep>> steps;
  bool trend_belongs;  ///< a trend of the place belongs to the curve over the position

  Followed(const FitData& all, const FitPoint& point, const ResidualWalk& walk, bool with_trend)
      : data(all),
        traces(smooth_residuals(all, point, walk)),
        steps(linearise(all, point)),
        trend_belongs(with_trend) {}

  std::vector<CurveArgument> arguments(Table::Over over) const {
    std::vector<CurveArgument> all;
    for (const ResidualTrace& trace : traces) {
      const Measurement& run = (*data.runs)[trace.run];
      const bool acts = run.has_cart() && !run.cart_locked;
      all.push_back(acts ? argument_along(trace, over) : CurveArgument{});
    }
    return all;
  }

  CurveEquations equations(const CurveNodes& nodes, Table::Over over,
                           const std::vector<CurveArgument>& along) const {
    const CurveEquations all = curve_equations(steps, nodes, along);
    return over == Table::position && trend_belongs ? all : beyond_known(all, nodes, over);
  }
};

/// A curve over one quantity, as the innovations of a fit show it beyond what known effects have.
struct Curve {
  Table::Over over = Table::velocity;
  double evidence = 0.0;              ///< of a curve of many nodes, on training data
  double held_evidence = 0.0;         ///< what the same curve saves on held-out data
  CurveNodes nodes;                   ///< of the table
  Eigen::MatrixXd prior_information;  ///< of the forces at these nodes
  double deviation = 0.0;             ///< of these forces from their level
  Eigen::VectorXd force_n;            ///< expected at these nodes
};

/// The prior information of a curve at the nodes of its table. Over the position, the ends do not deviate
/// from its level, as far as its forces are told apart.
Eigen::MatrixXd table_prior(const RandomCurve& curve, const CurveNodes& nodes, Table::Over over) {
  if (over == Table::velocity) return curve.prior_information(nodes);
  const CurveNodes inner{nodes.first + nodes.spacing, nodes.spacing, nodes.count - 2};
  const auto count = static_cast<Eigen::Index>(nodes.count);
  const double told_n = 1e-3 * curve.deviation();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(count, count);
  information.block(1, 1, count - 2, count - 2) = curve.prior_information(inner);
  information(0, 0) = information(count - 1, count - 1) = 1.0 / (told_n * told_n);
  return information;
}

/// Curves over each quantity, the one with the most evidence first. A curve that held-out data contradict
/// describes the training data alone, so it is left out.
std::vector<Curve> curves_of(const Followed& train, const Followed& held, std::size_t many,
                             const CurvePolicy& policy) {
  std::vector<Curve> curves;
  for (int number = 0; number < Table::over_count; ++number) {
    const auto over = static_cast<Table::Over>(number);
    const std::vector<CurveArgument> along = train.arguments(over);
    const CurveNodes nodes = nodes_along(along, many);
    if (nodes.count == 0) continue;
    const CurveEquations shown = train.equations(nodes, over, along);
    const RandomCurve curve(shown, nodes);
    if (!curve.is_there()) continue;
    const Eigen::VectorXd force_n = curve.mean(shown);
    const CurveEquations unseen = held.equations(nodes, over, held.arguments(over));
    const double held_evidence = 2.0 * force_n.dot(unseen.score) - force_n.dot(unseen.information * force_n);
    if (!(held_evidence > 0.0)) continue;
    const CurveNodes few = table_nodes(along, over, curve.length(), policy);
    curves.push_back(
        {over, -curve.change(), held_evidence, few, table_prior(curve, few, over), curve.deviation(), {}});
  }
  std::stable_sort(curves.begin(), curves.end(),
                   [](const Curve& a, const Curve& b) { return a.evidence > b.evidence; });
  return curves;
}

/// The effect that is a curve of this kind with the same value everywhere.
std::optional<std::size_t> level_effect(Table::Over over) {
  switch (over) {
    case Table::position:
      return effect_number("constant_force");
    case Table::position_and_direction:
      return effect_number("coulomb_friction");
    case Table::position_and_velocity:
      return effect_number("viscous_friction");
    default:
      return std::nullopt;
  }
}

/// Gives a curve a level of its own, which is expected to be as large as what deviates from it: by the matrix
/// inversion lemma, from the covariance with the square of the deviation added everywhere. A level that an
/// effect of the model has already stays with that effect.
void free_level(Curve& curve, const std::vector<FreeParameter>& free) {
  const std::optional<std::size_t> level = level_effect(curve.over);
  if (!level) return;
  std::vector<std::size_t> same = same_force_as(*level);
  same.push_back(*level);
  for (const FreeParameter& p : free)
    if (std::find(same.begin(), same.end(), p.effect) != same.end()) return;
  const Eigen::VectorXd pull = curve.prior_information.rowwise().sum();
  const double of_level = 1.0 / (curve.deviation * curve.deviation);
  curve.prior_information -= pull * pull.transpose() / (of_level + pull.sum());
}

/// The expected values of a curve at the few nodes of its table. Where no data are, they are near the
/// level of the curve, or near zero if it has none: the size of the curve is that of the force, not what a
/// few nodes would need to follow its details.
void draw_table(const Followed& train, Curve& curve) {
  const CurveEquations shown = train.equations(curve.nodes, curve.over, train.arguments(curve.over));
  curve.force_n = solve_symmetric(shown.information + curve.prior_information, shown.score);
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
  if (free.size() + Table::node_count > max_free_parameters(h.train.point.plant)) free.clear();
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
  const Curve& best = curves.front();
  std::ostringstream text;
  text.precision(3);
  text << "a curve over " << quantity_names[best.over] << " (evidence " << best.evidence
       << " on the training data and " << best.held_evidence << " on held-out data";
  if (curves.size() > 1)
    text << "; the next best, over " << quantity_names[curves[1].over] << ", has " << curves[1].evidence;
  text << ")";
  return text.str();
}

/// The curve of a fit as a formula; empty if none fits it.
std::string formula_of_fit(const FitResult& fitted, const Curve& curve) {
  const auto nodes = static_cast<Eigen::Index>(Table::node_count);
  const auto& values = fitted.point.plant.find(effect_index<Table>())->values;
  const Eigen::VectorXd force_n = Eigen::Map<const Eigen::VectorXd>(&values[Table::first_node], nodes);
  const auto formula = formula_of(curve.nodes, force_n, fitted.covariance.bottomRightCorner(nodes, nodes));
  if (!formula) return "";
  const bool of_velocity = curve.over == Table::velocity;
  return "; within its uncertainty it is " +
         formula->text(of_velocity ? "v" : "x", of_velocity ? "m/s" : "m");
}

/// Fits the table to the training data and to all, and simulates held-out data. The error stays infinite
/// where a fit fails.
void fit_table(const Search& search, const Curve& curve, ForceDescription& force) {
  const FitPoint judged = force.judged.train.point, known = force.known.train.point;
  force.judged.free = force.known.free = free_beside(search, force.judged, curve);
  force.judged.train = fit_with_curve(search.train_data(), moved_to(judged, with_table(judged.plant, curve)),
                                      force.judged.free, curve);
  if (!std::isfinite(force.judged.train.objective)) return;
  Plant plant = known.plant;
  plant.set(effect_index<Table>(), force.judged.train.point.plant.find(effect_index<Table>())->values);
  force.known.train = fit_with_curve(search.all_data(), moved_to(known, plant), force.known.free, curve);
  if (!std::isfinite(force.known.train.objective)) return;
  force.where += formula_of_fit(force.known.train, curve);
  search.filter_held_out(force.judged, sensors_only(force.judged.train.point.noise));
  force.held_out_error = search.gap_of(force.judged);
}

}  // namespace

bool ForceDescription::shows_on_held_out(double lower, const SelectionPolicy& policy) const {
  return lower > std::exp(policy.significance.visible_change) ||
         (is_of_velocity && held_evidence > policy.acceptance.min_evidence);
}

bool ForceDescription::moved(std::size_t effect) const {
  return std::any_of(known.free.begin(), known.free.end(),
                     [&](const FreeParameter& p) { return p.effect == effect; });
}

std::string ForceDescription::left_sentence() const {
  return "a force is left that no effect describes: " + where;
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
                                               const Hypothesis& known, bool with_trend) {
  const FitData& train = search.train_data();
  const FitData& held = search.held_data();
  if (!search.range().cart_moves || held.segments.empty()) return std::nullopt;
  if (search.given().find(effect_index<Table>()) != nullptr) return std::nullopt;
  if (!search.is_of_all_data(known.train.point)) return std::nullopt;
  const ResidualWalk& walk = search.policy().location.walk;
  const Followed fitted(train, judged.train.point, walk, with_trend);
  std::vector<Curve> curves = curves_of(fitted, Followed(held, judged.held.point, walk, with_trend),
                                        search.budget().track_nodes, search.policy().curve);
  if (curves.empty() || !(curves.front().evidence > search.policy().acceptance.min_evidence))
    return std::nullopt;
  free_level(curves.front(), known.free);
  draw_table(fitted, curves.front());
  const Curve& curve = curves.front();
  ForceDescription force{
      judged, known, unbounded, sentence_of(curves), curve.over == Table::velocity, curve.held_evidence};
  force.judged.forget_simulations();
  fit_table(search, curve, force);
  return force;
}

}  // namespace upright
