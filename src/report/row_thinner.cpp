#include "row_thinner.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace upright {

namespace {

using DrawnValue = double (*)(const LogRecord&);

constexpr std::array<DrawnValue, 8> drawn = {
    [](const LogRecord& r) { return r.cart_m; },
    [](const LogRecord& r) { return r.theta_rad; },
    [](const LogRecord& r) { return r.voltage_requested_v; },
    [](const LogRecord& r) { return r.voltage_v; },
    [](const LogRecord& r) { return static_cast<double>(r.wake_late_ns); },
    [](const LogRecord& r) { return static_cast<double>(r.read_ns); },
    [](const LogRecord& r) { return static_cast<double>(r.compute_ns); },
    [](const LogRecord& r) { return static_cast<double>(r.write_ns); },
};

constexpr std::uint64_t first_block_rows = 64;  // of which seldom more than 18 are kept

}  // namespace

void RowThinner::add(const LogRecord& row) {
  kept_.push_back({rows_++, row});
  if (block_rows_ > 1 && rows_ % block_rows_ == 0) thin(block_begin_);
  if (kept_.size() <= max_rows) return;
  block_rows_ = std::max(first_block_rows, 2 * block_rows_);
  thin(0);
}

/// The indices in kept_, from `begin` to before `end`, of the rows of a block that are kept.
std::vector<std::size_t> RowThinner::chosen(std::size_t begin, std::size_t end) const {
  std::vector<std::size_t> places{begin, end - 1};
  for (const DrawnValue quantity : drawn) {
    std::size_t low = end, high = end, gap = end;
    for (std::size_t i = begin; i < end; ++i) {
      const double value = quantity(kept_[i].row);
      if (!std::isfinite(value)) {
        gap = i;
        continue;
      }
      if (low == end || value < quantity(kept_[low].row)) low = i;
      if (high == end || value > quantity(kept_[high].row)) high = i;
    }
    for (const std::size_t place : {low, high, gap})
      if (place != end) places.push_back(place);
  }
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  return places;
}

/// Thins the blocks from an index in kept_ on. The last block may be incomplete.
void RowThinner::thin(std::size_t from) {
  std::vector<Kept> thinned;
  for (std::size_t begin = from, end = from; begin < kept_.size(); begin = end) {
    const std::uint64_t block = kept_[begin].place / block_rows_;
    while (end < kept_.size() && kept_[end].place / block_rows_ == block) ++end;
    block_begin_ = from + thinned.size();
    for (const std::size_t place : chosen(begin, end)) thinned.push_back(kept_[place]);
  }
  kept_.resize(from);
  kept_.insert(kept_.end(), thinned.begin(), thinned.end());
  if (rows_ % block_rows_ == 0) block_begin_ = kept_.size();
}

std::vector<LogRecord> RowThinner::take() {
  std::vector<LogRecord> rows;
  rows.reserve(kept_.size());
  for (const Kept& kept : kept_) rows.push_back(kept.row);
  kept_ = {};
  return rows;
}

}  // namespace upright
