#include "time_stamps.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "base/median.hpp"
#include "model/dense_algebra.hpp"

namespace upright {

namespace {

/// Windows of so many rows, each followed by a polynomial of so many coefficients.
constexpr Eigen::Index rows = 15, coefficients = 5;
constexpr std::size_t min_stamp_windows = 24, max_stamp_windows = 4000;
/// Steps of stamps differ by this share of their mean before anything is looked for.
constexpr double min_scatter = 0.02;
/// The motion leaves so many times as much with the stamps as with a steady clock.
constexpr double better_with_stamps = 5.0;

/// Periods that differ by less are the same one.
constexpr double same_period = 0.01;

using Window = Eigen::Matrix<double, rows, 1>;

/// Sum of squares that a polynomial of time leaves.
double left_of(const Window& time, const Window& values) {
  Eigen::MatrixXd basis(rows, coefficients);
  const double middle = 0.5 * (time[0] + time[rows - 1]), half = 0.5 * (time[rows - 1] - time[0]);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double u = (time[i] - middle) / half;
    for (Eigen::Index j = 0; j < coefficients; ++j) basis(i, j) = j == 0 ? 1.0 : basis(i, j - 1) * u;
  }
  const Eigen::VectorXd centred = values.array() - values.mean();
  return (centred - basis * least_squares(basis, centred)).squaredNorm();
}

/// First rows of windows without a gap in them.
std::vector<std::size_t> windows_of(const Measurement& run) {
  const auto length = static_cast<std::size_t>(rows);
  std::vector<std::size_t> firsts;
  const std::size_t step = std::max(length, run.size() / max_stamp_windows);
  for (std::size_t first = 0; first + length <= run.size(); first += step) {
    const auto next = std::upper_bound(run.breaks.begin(), run.breaks.end(), first);
    if (next == run.breaks.end() || *next >= first + length) firsts.push_back(first);
  }
  return firsts;
}

}  // namespace

std::optional<ScatteredStamps> find_scatter(const Measurement& run) {
  const std::vector<std::size_t> firsts = windows_of(run);
  if (firsts.size() < min_stamp_windows) return std::nullopt;
  Window steady;
  for (Eigen::Index i = 0; i < rows; ++i) steady[i] = static_cast<double>(i);
  std::vector<double> periods, scatters;
  for (const std::size_t first : firsts) {
    const Eigen::Map<const Window> time(run.time_s.data() + first);
    const double period_s = (time[rows - 1] - time[0]) / static_cast<double>(rows - 1);
    periods.push_back(period_s);
    double squares = 0.0;
    for (Eigen::Index i = 1; i < rows; ++i) squares += std::pow(time[i] - time[i - 1] - period_s, 2);
    // A step is the difference of two stamps.
    scatters.push_back(std::sqrt(0.5 * squares / static_cast<double>(rows - 1)));
  }
  ScatteredStamps found{median_of(periods), median_of(scatters)};
  // Over the whole record the stamps scatter least, where no rows are missing.
  const double mean_s = (run.time_s.back() - run.time_s.front()) / static_cast<double>(run.size() - 1);
  if (std::abs(mean_s - found.period_s) < same_period * found.period_s) found.period_s = mean_s;
  if (found.scatter_s < min_scatter * found.period_s) return std::nullopt;
  for (const std::vector<double>* channel : {&run.cart_m, &run.theta_rad}) {
    if (channel->empty()) continue;
    double stamped = 0.0, clocked = 0.0;
    for (const std::size_t first : firsts) {
      const Eigen::Map<const Window> time(run.time_s.data() + first), values(channel->data() + first);
      stamped += left_of(time, values);
      clocked += left_of(steady, values);
    }
    if (stamped > better_with_stamps * clocked && clocked >= 0.0 && stamped > 0.0) return found;
  }
  return std::nullopt;
}

}  // namespace upright
