#include "long_records.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace upright {

namespace {

/// Long enough for four segments of a fit and what its start costs (cut_segments: half a second at most).
constexpr double piece_s = 8.5;

/// Samples first..last-1.
struct RowRange {
  std::size_t first, last;
};

std::vector<RowRange> pieces_of(const Measurement& run, double part) {
  const double duration_s = run.time_s.back() - run.time_s.front();
  const auto count = std::max<std::size_t>(1, static_cast<std::size_t>(part * duration_s / piece_s));
  const double length_s = part * duration_s / static_cast<double>(count);
  const double every_s = duration_s / static_cast<double>(count);
  std::vector<RowRange> pieces;
  for (std::size_t i = 0; i < count; ++i) {
    const double from_s = run.time_s.front() + (static_cast<double>(i) + 0.5) * every_s - 0.5 * length_s;
    const auto at = [&](double time_s) {
      return static_cast<std::size_t>(std::lower_bound(run.time_s.begin(), run.time_s.end(), time_s) -
                                      run.time_s.begin());
    };
    pieces.push_back({at(from_s), at(from_s + length_s)});
  }
  return pieces;
}

void keep_pieces(std::vector<double>& values, const std::vector<RowRange>& pieces) {
  if (values.empty()) return;
  auto to = values.begin();
  for (const RowRange& piece : pieces)
    to = std::move(values.begin() + static_cast<std::ptrdiff_t>(piece.first),
                   values.begin() + static_cast<std::ptrdiff_t>(piece.last), to);
  values.erase(to, values.end());
  values.shrink_to_fit();
}

void keep_pieces(Measurement& run, const std::vector<RowRange>& pieces) {
  std::vector<std::size_t> breaks;
  std::size_t kept = 0;
  for (const RowRange& piece : pieces) {
    if (kept > 0) breaks.push_back(kept);
    for (const std::size_t at : run.breaks)
      if (at > piece.first && at < piece.last) breaks.push_back(kept + at - piece.first);
    kept += piece.last - piece.first;
  }
  for (std::vector<double>* values :
       {&run.time_s, &run.voltage_v, &run.cart_m, &run.theta_rad, &run.cart_weight, &run.theta_weight})
    keep_pieces(*values, pieces);
  run.breaks = std::move(breaks);
  run.unfoldings.clear();
}

std::size_t samples_in(const std::vector<Measurement>& runs) {
  std::size_t count = 0;
  for (const Measurement& run : runs) count += run.size();
  return count;
}

}  // namespace

std::vector<Measurement> within_samples(std::vector<Measurement> runs, std::size_t max_samples) {
  const std::size_t all = samples_in(runs);
  if (all <= max_samples) return runs;
  const double part = static_cast<double>(max_samples) / static_cast<double>(all);
  std::vector<Measurement> kept;
  double owed = 0.5;
  for (Measurement& run : runs) {
    if (part * (run.time_s.back() - run.time_s.front()) >= piece_s) {
      keep_pieces(run, pieces_of(run, part));
    } else {
      owed += part;
      if (owed < 1.0) continue;
      owed -= 1.0;
    }
    kept.push_back(std::move(run));
  }
  if (kept.empty()) kept.push_back(std::move(runs.front()));
  kept.front().notes.push_back(
      "the data hold " + std::to_string(all) + " samples; " + std::to_string(samples_in(kept)) +
      " of them are used, in pieces of some seconds spread evenly, since all would take hours: choose a "
      "stretch with from_s and to_s in a dataset file if another part matters");
  return kept;
}

}  // namespace upright
