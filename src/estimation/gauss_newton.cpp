#include "gauss_newton.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include "attached_start.hpp"
#include "base/parallel.hpp"
#include "model/dense_algebra.hpp"
#include "parameter_equations.hpp"
#include "state_vector.hpp"

namespace upright {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
using Matrix = Eigen::MatrixXd;

/// Information on the initial state beyond the data: nearly none, enough to keep unmeasured states in place.
constexpr double start_information[state_count] = {1.0, 1.0, 0.1, 0.01, 1e4, 1e4, 10.0};

/// Of the first states of a segment's start: what the data say, and the little beyond them.
Matrix information_of_start(const NormalEquations& n, int states = state_count) {
  Matrix information = n.information.topLeftCorner(states, states);
  for (int i = 0; i < states; ++i) information(i, i) += start_information[i];
  return information;
}

/// Of a state that stays where it is.
constexpr double held_information = 1e30;

/// By how much bristles can be bent [m]: no further than friction holds them (the LuGre model, IEEE Trans.
/// Autom. Control 40 (1995) 419, property 1). A state beyond it snaps back in no time, which no step length
/// follows.
double longest_bend_m(const Dynamics<double>& dynamics, const PlantState<double>& state) {
  if (dynamics.depends_on_load() || dynamics.changes_with_time()) return infinity;
  const double level_n = std::max(dynamics.cart_dry_level(state.cart_m, 0.0, 1.0),
                                  dynamics.cart_dry_level(state.cart_m, 0.0, -1.0));
  return level_n / dynamics.bristle_stiffness();
}

/// Whether bristles are bent as far as they may, and the data (`score`) would bend them further.
bool bristles_are_at_end(const Dynamics<double>& dynamics, const PlantState<double>& start, double score) {
  constexpr double nearly = 0.999;
  return dynamics.has_bristle_state() && score * start.bristle_m > 0.0 &&
         std::abs(start.bristle_m) >= nearly * longest_bend_m(dynamics, start);
}

/// Changes the way of an initial state so that it bends the bristles by this much, and the others fit that.
void bend_bristles_by(double bend_m, const NormalEquations& n, Eigen::VectorXd& way) {
  Matrix information = information_of_start(n);
  Eigen::VectorXd score = information.col(bristle_state) * (bend_m - way[bristle_state]);
  score[bristle_state] = 0.0;
  information(bristle_state, bristle_state) += held_information;
  way.head<state_count>() -= solve_symmetric(information, score).col(0);
  way[bristle_state] = bend_m;
}

/// By how much a quadratic objective falls along a way.
double promise(const Matrix& information, const Eigen::VectorXd& slope, const Eigen::VectorXd& way) {
  return 2.0 * slope.dot(way) - way.dot(information * way);
}

/// Sizes enter nearly linearly and may go far at once; shapes, places and times may not.
double longest_step(const FreeParameter& p, double value) {
  const bool size = effect_registry()[p.effect].parameters[p.index].neutral == 0.0;
  return size ? std::max(std::abs(value), 4.0 * p.scale) : 0.5 * std::max(std::abs(value), p.scale);
}

}  // namespace

Prior::Prior(const std::vector<FreeParameter>& free, const std::optional<GaussianPrior>& joint)
    : free_(free) {
  const auto np = static_cast<Eigen::Index>(free.size());
  mean_.setZero(np);
  information_.setZero(np, np);
  if (joint) {
    information_ = joint->information;
    mean_ = joint->mean;
    return;
  }
  for (Eigen::Index j = 0; j < np; ++j) {
    const FreeParameter& p = free[static_cast<std::size_t>(j)];
    mean_[j] = p.prior_mean;
    if (p.prior_sigma > 0.0) information_(j, j) = 1.0 / (p.prior_sigma * p.prior_sigma);
  }
}

Eigen::VectorXd Prior::deviation(const Plant& plant) const {
  Eigen::VectorXd off(static_cast<Eigen::Index>(free_.size()));
  for (std::size_t j = 0; j < free_.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    off[at] = plant.find(free_[j].effect)->values[free_[j].index] - mean_[at];
  }
  return off;
}

double Prior::objective(const Plant& plant) const {
  if (free_.empty()) return 0.0;
  const Eigen::VectorXd off = deviation(plant);
  return off.dot(information_ * off);
}

/// The normal equations of the parameters, with the initial states eliminated (Schur complement). The initial
/// state of segment s moves by base[s] - back[s] * (step of the parameters).
struct GaussNewton::ReducedEquations {
  Matrix information;
  Eigen::VectorXd score;
  std::vector<Eigen::Matrix<double, state_count, Eigen::Dynamic>> back;
  std::vector<Eigen::Matrix<double, state_count, 1>> base;
};

GaussNewton::GaussNewton(const FitData& data, const FitPoint& start, const std::vector<FreeParameter>& free,
                         const FitOptions& options)
    : data_(data),
      free_(free),
      options_(options),
      point_(start),
      prior_(free, options.joint_prior),
      linearised_(data.segments.size()),
      former_(data.segments.size()),
      order_(data.segments.size()) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
}

void GaussNewton::linearise(std::size_t s) {
  const Segment& segment = data_.segments[s];
  if (is_driven_by_cart(point_.plant))
    point_.starts[s] =
        MotionBefore((*data_.runs)[segment.run], segment).with_mass(point_.plant, point_.starts[s]);
  linearise_segment(data_, s, point_, free_, linearised_[s].steps, &linearised_[s].normal);
}

/// All samples once, whether or not all were looked at: which are may depend on the number of cores.
void GaussNewton::count_work() {
  for (const Segment& s : data_.segments) work_samples_ += static_cast<double>(s.last - s.first + 1);
}

double GaussNewton::evaluate() {
  count_work();
  parallel_for(order_.size(), [&](std::size_t i) { linearise(order_[i]); });
  return objective_of_normals() + prior_.objective(point_.plant);
}

double GaussNewton::begin_with(const std::vector<NormalEquations>& equations) {
  for (std::size_t s = 0; s < equations.size(); ++s) linearised_[s].normal = equations[s];
  return objective_of_normals() + prior_.objective(point_.plant);
}

void GaussNewton::require_steps() {
  if (std::ranges::any_of(linearised_, [](const LinearisedSegment& s) { return s.steps.empty(); }))
    evaluate();
}

/// By how much a segment's objective rises with a step.
double GaussNewton::rise_of(std::size_t s) const {
  return linearised_[s].normal.likelihood.objective() - former_[s].normal.likelihood.objective();
}

/// Replaces the start of a segment if its objective is lower from the other one.
void GaussNewton::take_start_if_better(std::size_t s, const PlantState<double>& alternative) {
  const PlantState<double> former_start = std::exchange(point_.starts[s], alternative);
  LinearisedSegment former = std::exchange(linearised_[s], {});
  linearise(s);
  if (linearised_[s].normal.likelihood.objective() < former.normal.likelihood.objective()) return;
  point_.starts[s] = former_start;
  linearised_[s] = std::move(former);
}

/// The same after a step. Infinity where one segment, in which the cart sticks or slides for all the others
/// say, is further off than the others can make up for: the rest are not looked at, and it is looked at first
/// from then on. A start at held speed keeps one segment from stopping all others; alone, its step is damped.
double GaussNewton::evaluate_step(const std::vector<PlantState<double>>& starts_at_held_speed,
                                  double predicted_reduction) {
  constexpr double out_of_reach = 3.0;
  count_work();
  const std::size_t none = order_.size();
  const bool has_others = order_.size() > 1;
  std::atomic<std::size_t> rejecting_segment = none;
  parallel_for(order_.size(), [&](std::size_t i) {
    if (rejecting_segment != none) return;
    const std::size_t s = order_[i];
    linearise(s);
    if (has_others && !(rise_of(s) < predicted_reduction)) take_start_if_better(s, starts_at_held_speed[s]);
    if (!(rise_of(s) < out_of_reach * predicted_reduction)) rejecting_segment = i;
  });
  if (rejecting_segment == none) return objective_of_normals() + prior_.objective(point_.plant);
  const auto place = order_.begin() + static_cast<std::ptrdiff_t>(rejecting_segment.load());
  std::rotate(order_.begin(), place, std::next(place));
  return infinity;
}

double GaussNewton::objective_of_normals() const {
  double sum = 0.0;
  for (const LinearisedSegment& segment : linearised_) sum += segment.normal.likelihood.objective();
  return sum;
}

double GaussNewton::sample_count() const {
  double count = 0.0;
  for (const LinearisedSegment& segment : linearised_) count += segment.normal.likelihood.samples;
  return count;
}

void GaussNewton::descend(double& objective) {
  double damping = negligible_damping;
  converged_ = false;
  for (int iteration = 0;
       iteration < options_.max_iterations && std::isfinite(objective) && is_within_bound(); ++iteration) {
    // Far from the optimum the equations are not those of the optimum, and an undamped step goes astray.
    if (iteration == 0 && step(damping).predicted_reduction > sample_count()) damping = far_damping;
    const double min_fall = options_.tolerance * sample_count() * 0.1 + 0.02;
    const double next_objective = try_steps(objective, min_fall, damping);
    if (!(next_objective < objective)) {
      converged_ = true;
      break;
    }
    const double fall = objective - next_objective;
    objective = next_objective;
    if (fall < min_fall) {
      converged_ = true;
      break;
    }
  }
}

/// Goes the first of several steps, each damped more, after which the objective is less: which it is then.
/// Where none is, the point stays.
double GaussNewton::try_steps(double objective, double min_fall, double& damping) {
  const FitPoint former = point_;
  double next_objective = infinity, rejected = infinity;
  for (int attempt = 0; attempt < 4; ++attempt) {
    Step next = step(damping);
    if (next.predicted_reduction < min_fall && attempt == 0 && damping > negligible_damping)
      next = step(damping = negligible_damping);
    const bool promises = next.predicted_reduction >= min_fall;
    if (!promises && !next.cut_short) break;
    // A step that hardly differs from one that was rejected is not worth looking at, nor is one that does
    // not even promise to fall.
    constexpr double alike = 0.9;
    if (promises && next.predicted_reduction < alike * rejected) {
      point_ = std::move(next.point);
      linearised_.swap(former_);
      next_objective = evaluate_step(next.starts_at_held_speed, std::max(next.predicted_reduction, min_fall));
      if (next_objective < objective) break;
      point_ = former;
      linearised_.swap(former_);
      rejected = next.predicted_reduction;
    }
    damping = std::max(damping * damping_growth, first_damping);
  }
  // Where a step had to be damped, the next one has to be too, but less.
  if (next_objective < objective) damping = std::max(damping * damping_decay, negligible_damping);
  return next_objective;
}

GaussNewton::ReducedEquations GaussNewton::eliminate_initial_states(double damping) const {
  const auto np = static_cast<Eigen::Index>(free_.size());
  ReducedEquations reduced;
  reduced.information = prior_.information();
  reduced.score = -prior_.information() * prior_.deviation(point_.plant);
  reduced.back.resize(linearised_.size());
  reduced.base.resize(linearised_.size());
  const Dynamics<double> dynamics(make_model<double>(point_.plant));
  for (std::size_t s = 0; s < linearised_.size(); ++s) {
    const NormalEquations& n = linearised_[s].normal;
    Matrix hii = n.information.topLeftCorner(state_count, state_count);
    for (int i = 0; i < state_count; ++i) hii(i, i) += start_information[i] + damping * hii(i, i);
    if (bristles_are_at_end(dynamics, point_.starts[s], n.score[bristle_state]))
      hii(bristle_state, bristle_state) += held_information;
    Matrix right(state_count, np + 1);
    right << n.information.topRightCorner(state_count, np), n.score.head(state_count);
    const Matrix solved = solve_symmetric(hii, right);
    reduced.back[s] = solved.leftCols(np);
    reduced.base[s] = solved.col(np);
    reduced.information += n.information.bottomRightCorner(np, np) -
                           n.information.bottomLeftCorner(np, state_count) * reduced.back[s];
    reduced.score += n.score.tail(np) - n.information.bottomLeftCorner(np, state_count) * reduced.base[s];
  }
  return reduced;
}

namespace {

ParameterEquations without_initial_state(const NormalEquations& n, Eigen::Index np) {
  const Matrix back = solve_symmetric(information_of_start(n), n.information.topRightCorner(state_count, np));
  return {n.information.bottomRightCorner(np, np) - n.information.bottomLeftCorner(np, state_count) * back,
          n.score.tail(np) - back.transpose() * n.score.head(state_count)};
}

}  // namespace

std::vector<ParameterEquations> parameter_equations(const FitData& data, const FitPoint& point,
                                                    const std::vector<FreeParameter>& free) {
  const auto np = static_cast<Eigen::Index>(free.size());
  std::vector<ParameterEquations> equations(data.segments.size());
  parallel_for(data.segments.size(), [&](std::size_t s) {
    LinearisedSegment at;
    linearise_segment(data, s, point, free, at.steps, &at.normal);
    equations[s] = without_initial_state(at.normal, np);
  });
  return equations;
}

GaussNewton::Information GaussNewton::information() const {
  const auto np = static_cast<Eigen::Index>(free_.size());
  Matrix h = prior_.information(), spread = Matrix::Zero(np, np);
  Eigen::VectorXd score = -prior_.information() * prior_.deviation(point_.plant);
  for (const LinearisedSegment& segment : linearised_) {
    const ParameterEquations reduced = without_initial_state(segment.normal, np);
    h += reduced.information;
    spread += reduced.score * reduced.score.transpose();
    score += reduced.score;
  }
  const auto segments = static_cast<double>(linearised_.size());
  const double small_sample = segments > np + 1.0 ? segments / (segments - 1.0) : 2.0;
  return {h, spread * small_sample, score};
}

/// The Gauss-Newton step of all segments: parameters first (initial states eliminated), then each initial
/// state.
GaussNewton::Step GaussNewton::step(double damping) const {
  const ReducedEquations reduced = eliminate_initial_states(damping);
  Step result{point_, {}};
  Eigen::VectorXd delta = bounded_step(reduced, damping, result.cut_short);
  move_parameters(delta, result);
  const Eigen::VectorXd to_belief = -prior_.information() * prior_.deviation(point_.plant);
  result.predicted_reduction = promise(prior_.information(), to_belief, delta);
  convert_initial_states(result.point.starts, point_.plant, result.point.plant);
  result.starts_at_held_speed = result.point.starts;
  move_start_positions(delta, result);
  move_initial_states(reduced, delta, result);
  return result;
}

/// Moves the parameters, each as far as its bounds let it: `delta` is by how much then.
void GaussNewton::move_parameters(Eigen::VectorXd& delta, Step& result) const {
  Plant& plant = result.point.plant;
  for (Eigen::Index j = 0; j < delta.size(); ++j) {
    const FreeParameter& p = free_[static_cast<std::size_t>(j)];
    PlantEffect effect = *plant.find(p.effect);
    const double wanted = effect.values[p.index] + delta[j], moved = std::clamp(wanted, p.low, p.high);
    result.cut_short = result.cut_short || moved != wanted;
    delta[j] = moved - effect.values[p.index];
    effect.values[p.index] = moved;
    plant.set(p.effect, effect.values);
  }
}

/// Moves the initial states after the parameters, none further than makes sense.
void GaussNewton::move_initial_states(const ReducedEquations& reduced, const Eigen::VectorXd& delta,
                                      Step& result) const {
  constexpr double longest[state_count] = {0.01, 0.3, 0.5, 3.0, 0.01, 0.01, 0.5};
  const Dynamics<double> dynamics(make_model<double>(result.point.plant));
  Eigen::VectorXd way(state_count + delta.size());
  way.tail(delta.size()) = delta;
  for (std::size_t s = 0; s < linearised_.size(); ++s) {
    PlantState<double>& start = result.point.starts[s];
    const auto values = as_array(start);
    way.head<state_count>() = reduced.base[s] - reduced.back[s] * delta;
    if (dynamics.has_bristle_state()) {
      const double most_m = longest_bend_m(dynamics, start), bent_m = start.bristle_m + way[bristle_state];
      if (std::abs(bent_m) > most_m)
        bend_bristles_by(std::copysign(most_m, bent_m) - start.bristle_m, linearised_[s].normal, way);
    }
    for (int i = 0; i < state_count; ++i) {
      result.cut_short = result.cut_short || std::abs(way[i]) > longest[i];
      way[i] = std::clamp(way[i], -longest[i], longest[i]);
      *values[static_cast<std::size_t>(i)] += way[i];
    }
    result.predicted_reduction +=
        promise(linearised_[s].normal.information, linearised_[s].normal.score, way);
  }
}

/// Moves the initial positions after the parameters, and no speed. A cart that soon comes to rest stops at a
/// distance that grows with the square of its initial speed. Near zero this speed has next to no derivative,
/// so that a step of it can be far too long.
void GaussNewton::move_start_positions(const Eigen::VectorXd& delta, Step& result) const {
  constexpr int positions = 2;
  for (std::size_t s = 0; s < linearised_.size(); ++s) {
    const NormalEquations& n = linearised_[s].normal;
    const Eigen::VectorXd score =
        n.score.head(positions) -
        n.information.topRightCorner(state_count, delta.size()).topRows(positions) * delta;
    const Eigen::VectorXd way = solve_symmetric(information_of_start(n, positions), score);
    const auto values = as_array(result.starts_at_held_speed[s]);
    for (int i = 0; i < positions; ++i) *values[static_cast<std::size_t>(i)] += way[i];
  }
}

/// Solves for the parameters. One that would go beyond its range, or further than makes sense, goes as far as
/// it may, and the others are solved again for that: parameters that are one force change together.
Eigen::VectorXd GaussNewton::bounded_step(const ReducedEquations& reduced, double damping,
                                          bool& cut_short) const {
  const Eigen::Index np = reduced.score.size();
  Eigen::VectorXd delta = Eigen::VectorXd::Zero(np);
  std::vector<Eigen::Index> moving(static_cast<std::size_t>(np));
  std::iota(moving.begin(), moving.end(), Eigen::Index{0});
  for (bool again = true; again && !moving.empty();) {
    for (const Eigen::Index j : moving) delta[j] = 0.0;
    const Eigen::VectorXd solved = solve_for(moving, delta, reduced, damping);
    std::vector<Eigen::Index> free;
    for (std::size_t a = 0; a < moving.size(); ++a) {
      const Eigen::Index j = moving[a];
      const FreeParameter& p = free_[static_cast<std::size_t>(j)];
      const double value = point_.plant.find(p.effect)->values[p.index], limit = longest_step(p, value);
      const double at = solved[static_cast<Eigen::Index>(a)], wanted = std::isfinite(at) ? at * p.scale : 0.0;
      const double to_low = std::min(p.low - value, 0.0), to_high = std::max(p.high - value, 0.0);
      delta[j] = std::clamp(wanted, std::max(-limit, to_low), std::min(limit, to_high));
      if (delta[j] == wanted) free.push_back(j);
      // What the data hold at an end of its range is where it should be.
      const bool is_held = delta[j] == 0.0 && (to_low == 0.0 || to_high == 0.0);
      cut_short = cut_short || (delta[j] != wanted && !is_held);
    }
    again = free.size() < moving.size();
    moving = std::move(free);
  }
  return delta;
}

/// Of the `moving` parameters, in units of their scales. The others go by `delta`.
Eigen::VectorXd GaussNewton::solve_for(const std::vector<Eigen::Index>& moving, const Eigen::VectorXd& delta,
                                       const ReducedEquations& reduced, double damping) const {
  const auto n = static_cast<Eigen::Index>(moving.size());
  const auto number = [&](Eigen::Index a) { return moving[static_cast<std::size_t>(a)]; };
  const auto scale = [&](Eigen::Index a) { return free_[static_cast<std::size_t>(number(a))].scale; };
  const Eigen::VectorXd score = reduced.score - reduced.information * delta;
  Matrix small(n, n);
  Eigen::VectorXd right(n);
  for (Eigen::Index a = 0; a < n; ++a) {
    right[a] = score[number(a)] * scale(a);
    for (Eigen::Index b = 0; b < n; ++b)
      small(a, b) = reduced.information(number(a), number(b)) * scale(a) * scale(b);
  }
  for (Eigen::Index a = 0; a < n; ++a) small(a, a) += damping * small(a, a) + 1e-6;
  return solve_symmetric(small, right);
}

}  // namespace upright
