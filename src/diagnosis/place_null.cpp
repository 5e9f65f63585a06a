#include "place_null.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

#include "estimation/place_force.hpp"
#include "listing.hpp"
#include "without_effect.hpp"

namespace upright {

namespace {

/// Correlation of the values of a random force at two places: Matern's, of smoothness 3/2.
double correlation(double distance_m, double length_m) {
  const double d = std::numbers::sqrt3 * distance_m / length_m;
  return (1.0 + d) * std::exp(-d);
}

/// A Gaussian random force with independent values c of variance v: F = L c at the nodes, in the axes in
/// which what the data say of c is uncorrelated as well.
struct PrincipalAxes {
  Eigen::MatrixXd forces;  ///< at the nodes, by axis, for a unit of c
  Eigen::VectorXd information;

  PrincipalAxes(const PlaceForceEquations& equations, const TrackNodes& nodes, double length_m) {
    const auto n = static_cast<Eigen::Index>(nodes.count);
    Eigen::MatrixXd covariance(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j)
        covariance(i, j) = correlation(nodes.spacing_m * static_cast<double>(std::abs(i - j)), length_m);
    constexpr double regular = 1e-9;  // of the variance: keeps the factor regular
    covariance.diagonal().array() += regular;
    const Eigen::MatrixXd factor = covariance.llt().matrixL();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(factor.transpose() * equations.information *
                                                              factor);
    forces = factor * axes.eigenvectors();
    information = axes.eigenvalues().cwiseMax(0.0);
  }
};

/// By how much minus twice the log likelihood changes if the force is integrated out.
double marginal_change(const Eigen::VectorXd& information, const Eigen::VectorXd& score, double variance) {
  double change = 0.0;
  for (Eigen::Index i = 0; i < score.size(); ++i) {
    const double widened = 1.0 + variance * information[i];
    change += std::log(widened) - variance * score[i] * score[i] / widened;
  }
  return change;
}

/// The random force of a track, its size and correlation length by maximum marginal likelihood.
class TrackForce {
 public:
  TrackForce(const PlaceForceEquations& equations, const TrackNodes& nodes) : nodes_(nodes) {
    const double travel_m = nodes.spacing_m * static_cast<double>(nodes.count - 1);
    for (double length_m = nodes.spacing_m; length_m < travel_m; length_m *= 2.0) {
      const PrincipalAxes axes(equations, nodes, length_m);
      const double largest = axes.information.maxCoeff();
      if (!(largest > 0.0)) return;
      const Eigen::VectorXd score = axes.forces.transpose() * equations.score;
      // From a force that the data cannot show to one that they show a million times over.
      for (double variance = 0.1 / largest; variance < 1e12 / largest; variance *= std::numbers::sqrt2)
        consider(variance, length_m, marginal_change(axes.information, score, variance));
    }
  }

  /// Whether there is any: a force of zero is not the most likely one.
  bool is_there() const { return variance_ > 0.0; }
  /// Of minus twice the log likelihood at the fit that it was estimated at.
  double change() const { return change_; }
  double deviation_n() const { return std::sqrt(variance_); }
  double length_m() const { return length_m_; }

  /// The same at another fit.
  double change_at(const PlaceForceEquations& equations) const {
    const PrincipalAxes axes(equations, nodes_, length_m_);
    return marginal_change(axes.information, axes.forces.transpose() * equations.score, variance_);
  }

 private:
  void consider(double variance, double length_m, double change) {
    if (!(change < change_)) return;
    change_ = change;
    variance_ = variance;
    length_m_ = length_m;
  }

  TrackNodes nodes_;
  double variance_ = 0.0, length_m_ = 1.0, change_ = 0.0;
};

/// Nodes over the whole travel.
TrackNodes nodes_over(const FitData& data, std::size_t count) {
  double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
  for (const Segment& segment : data.segments) {
    const Measurement& run = (*data.runs)[segment.run];
    if (!run.has_cart() || run.cart_locked) continue;
    for (std::size_t k = segment.first; k <= segment.last; ++k) {
      low_m = std::min(low_m, run.cart_m[k]);
      high_m = std::max(high_m, run.cart_m[k]);
    }
  }
  if (!(high_m > low_m)) return {};
  return {low_m, (high_m - low_m) / static_cast<double>(count - 1), count};
}

class PlaceNull {
 public:
  PlaceNull(const Search& search, const Hypothesis& known)
      : search_(search),
        known_(known),
        all_(search.all_data()),
        nodes_(nodes_over(all_, search.budget().track_nodes)) {
    if (nodes_.count == 0) return;
    track_.emplace(place_force_equations(all_, known.train.point, nodes_), nodes_);
  }

  /// Null if there is none.
  const TrackForce* track_force() const { return track_ && track_->is_there() ? &*track_ : nullptr; }

  /// What the effect saves beside the force, after the penalty of its parameters.
  double evidence_of(std::size_t effect) const {
    const FitPoint& with = known_.train.point;
    if (!is_removable(with.plant, effect, search_.given())) return std::numeric_limits<double>::infinity();
    FitOptions same_noise;
    same_noise.noise_rounds = 0;
    const FitResult without = fit_without(all_, with, effect, known_.free, search_.given(), same_noise);
    if (!std::isfinite(without.objective)) return std::numeric_limits<double>::infinity();
    return without.objective + track_->change_at(place_force_equations(all_, without.point, nodes_)) -
           known_.train.objective - track_->change() - search_.penalty_of(known_, effect);
  }

 private:
  const Search& search_;
  const Hypothesis& known_;
  FitData all_;
  TrackNodes nodes_;
  std::optional<TrackForce> track_;
};

/// Whether a simulation of held-out data without the effect is far worse.
bool is_needed(Search& search, const Hypothesis& judged, const std::vector<Reproduction>& effects,
               std::size_t effect) {
  std::vector<std::size_t> all, others;
  for (const Reproduction& other : effects) {
    all.push_back(other.effect);
    if (other.effect != effect) others.push_back(other.effect);
  }
  return held_out_error(search, judged, others) >
         search.policy().power.clear_gap * held_out_error(search, judged, all);
}

}  // namespace

std::optional<std::size_t> outdone_by_place(Search& search, const Hypothesis& known, const Hypothesis& judged,
                                            const std::vector<Reproduction>& effects) {
  std::optional<std::size_t> worst;
  if (known.train.point.starts.size() != search.all_data().segments.size()) return worst;
  std::optional<PlaceNull> null;
  double least = search.policy().acceptance.min_evidence;
  for (const Reproduction& found : effects) {
    if (search.is_nuisance(found.effect)) continue;
    if (!null) null.emplace(search, known);
    if (null->track_force() == nullptr) break;
    const double evidence = null->evidence_of(found.effect);
    if (!(evidence < least) || is_needed(search, judged, effects, found.effect)) continue;
    least = evidence;
    worst = found.effect;
  }
  return worst;
}

std::optional<std::string> place_force_left(const Search& search, const Hypothesis& known) {
  if (known.train.point.starts.size() != search.all_data().segments.size()) return std::nullopt;
  const PlaceNull null(search, known);
  const TrackForce* track = null.track_force();
  if (track == nullptr || !(-track->change() > search.policy().acceptance.min_evidence)) return std::nullopt;
  constexpr double mm_per_m = 1000.0;
  std::ostringstream text;
  text.precision(2);
  text << "the residual depends on the place: a random force of the track, with a standard deviation of "
       << track->deviation_n() << " N and a correlation length of " << mm_per_m * track->length_m()
       << " mm, accounts for a part of it";
  return text.str();
}

}  // namespace upright
