#include "force_curve.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.hpp"
#include "model/dense_algebra.hpp"
#include "state_vector.hpp"

namespace upright {

namespace {

constexpr Eigen::Index total_states = LinearStep::states + LinearStep::disturbances;
/// Rows that are multiplied at once.
constexpr Eigen::Index rows_at_once = 64;

/// Shares of two neighbouring nodes in the value of a curve.
struct NodeShares {
  std::size_t lower;
  double of_upper;
};

/// Beyond the nodes the curve is constant.
NodeShares shares_at(double quantity, const CurveNodes& nodes) {
  const double at = (quantity - nodes.first) / nodes.spacing;
  const double bounded = std::clamp(at, 0.0, static_cast<double>(nodes.count - 1));
  const std::size_t lower = std::min(static_cast<std::size_t>(bounded), nodes.count - 2);
  return {lower, bounded - static_cast<double>(lower)};
}

/// The normal equations of one segment: errors of the initial state first, then the nodes that it passes.
class SegmentEquations {
 public:
  SegmentEquations(const CurveArgument& argument, const CurveNodes& nodes)
      : argument_(argument), nodes_(nodes), first_(nodes.count) {
    std::size_t last = 0;
    for (const double quantity : argument.at) {
      const std::size_t lower = shares_at(quantity, nodes).lower;
      first_ = std::min(first_, lower);
      last = std::max(last, lower + 1);
    }
    columns_ = state_count + static_cast<Eigen::Index>(last - first_ + 1);
    state_ = RowMatrix::Zero(total_states, columns_);
    state_.topLeftCorner(state_count, state_count).setIdentity();
    information_ = Eigen::MatrixXd::Zero(columns_, columns_);
    score_ = Eigen::VectorXd::Zero(columns_);
    pending_ = Eigen::MatrixXd(columns_, rows_at_once);
  }

  void follow(const std::vector<LinearStep>& steps) {
    for (std::size_t k = 0; k < steps.size(); ++k) {
      if (k > 0) predict(steps[k], k - 1);
      for (int channel = 0; channel < 2; ++channel)
        if (steps[k].weight[channel] > 0.0 && steps[k].variance[channel] > 0.0) update(steps[k], channel);
    }
    add_pending();
  }

  /// Adds its part to the equations of all, without what an error of the initial state may account for.
  void add_to(CurveEquations& all) const {
    const Eigen::Index values = columns_ - state_count, first = static_cast<Eigen::Index>(first_);
    Eigen::MatrixXd of_start = information_.topLeftCorner(state_count, state_count);
    // A state that nothing shows, as the deflection of bristles that are not there, stays where it is.
    for (Eigen::Index i = 0; i < state_count; ++i)
      if (!(of_start(i, i) > 0.0)) of_start(i, i) = 1.0;
    const Eigen::VectorXd scale = of_start.diagonal().cwiseSqrt().cwiseInverse();
    of_start = scale.asDiagonal() * of_start * scale.asDiagonal();
    constexpr double smallest_share = 1e-10;  // keeps the factor regular
    of_start.diagonal().array() += smallest_share;
    Eigen::MatrixXd right(state_count, values + 1);
    right << information_.topRightCorner(state_count, values), score_.head(state_count);
    right = scale.asDiagonal() * right;
    const Eigen::MatrixXd accounted = right.leftCols(values).transpose() * solve_symmetric(of_start, right);
    all.information.block(first, first, values, values) +=
        information_.bottomRightCorner(values, values) - accounted.leftCols(values);
    all.score.segment(first, values) += score_.tail(values) - accounted.col(values);
  }

 private:
  using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// The force at the sample where a period begins acts over the period.
  void predict(const LinearStep& step, std::size_t from) {
    const NodeShares at = shares_at(argument_.at[from], nodes_);
    const double factor = argument_.factor.empty() ? 1.0 : argument_.factor[from];
    const Eigen::Index lower = state_count + static_cast<Eigen::Index>(at.lower - first_);
    for (Eigen::Index i = 0; i < 2; ++i) {
      for (Eigen::Index d = 0; d < LinearStep::disturbances; ++d)
        if (step.impulse[d][i] != 0.0 && step.keeps > 0.0)
          state_.row(2 + i) += step.impulse[d][i] * state_.row(state_count + d);
      state_(2 + i, lower) += factor * step.impulse[0][i] * (1.0 - at.of_upper);
      state_(2 + i, lower + 1) += factor * step.impulse[0][i] * at.of_upper;
    }
    const Eigen::Map<const Eigen::Matrix<double, LinearStep::states, LinearStep::states, Eigen::RowMajor>>
        transition(&step.transition[0][0]);
    state_.topRows(state_count) = (transition * state_.topRows(state_count)).eval();
    state_.bottomRows(LinearStep::disturbances) *= step.keeps;
  }

  void update(const LinearStep& step, int channel) {
    const Eigen::RowVectorXd row = step.gain[channel] * state_.row(channel);
    const double weight = step.weight[channel] / step.variance[channel];
    score_ += weight * step.innovation[channel] * row.transpose();
    pending_.col(rows_) = std::sqrt(weight) * row.transpose();
    if (++rows_ == rows_at_once) add_pending();
    for (Eigen::Index i = 0; i < total_states; ++i)
      if (step.update[channel][i] != 0.0) state_.row(i) -= step.update[channel][i] * row;
  }

  void add_pending() {
    information_.noalias() += pending_.leftCols(rows_) * pending_.leftCols(rows_).transpose();
    rows_ = 0;
  }

  const CurveArgument& argument_;
  const CurveNodes& nodes_;
  std::size_t first_;  ///< node that the segment passes
  Eigen::Index columns_ = 0, rows_ = 0;
  RowMatrix state_;  ///< change of the state's error with each column
  Eigen::MatrixXd information_, pending_;
  Eigen::VectorXd score_;
};

}  // namespace

std::vector<CurveArgument> shown_places(const FitData& data) {
  std::vector<CurveArgument> places(data.segments.size());
  for (std::size_t s = 0; s < places.size(); ++s) {
    const Segment& segment = data.segments[s];
    const Measurement& run = (*data.runs)[segment.run];
    if (!run.has_cart() || run.cart_locked) continue;
    const auto first = run.cart_m.begin() + static_cast<std::ptrdiff_t>(segment.first);
    places[s].at.assign(first, first + static_cast<std::ptrdiff_t>(segment.last - segment.first + 1));
  }
  return places;
}

CurveEquations curve_equations(const std::vector<std::vector<LinearStep>>& steps, const CurveNodes& nodes,
                               const std::vector<CurveArgument>& arguments) {
  const auto count = static_cast<Eigen::Index>(nodes.count);
  const CurveEquations nothing{Eigen::MatrixXd::Zero(count, count), Eigen::VectorXd::Zero(count)};
  std::vector<CurveEquations> parts(steps.size());
  parallel_for(steps.size(), [&](std::size_t s) {
    if (arguments[s].at.empty()) return;
    parts[s] = nothing;
    SegmentEquations equations(arguments[s], nodes);
    equations.follow(steps[s]);
    equations.add_to(parts[s]);
  });
  CurveEquations all = nothing;
  for (const CurveEquations& part : parts) {
    if (part.score.size() == 0) continue;
    all.information += part.information;
    all.score += part.score;
  }
  return all;
}

}  // namespace upright
