#include "column_delay.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

namespace {

double delay_of(const Dataset& dataset, std::string_view quantity) {
  const auto at = dataset.columns.find(quantity);
  return at == dataset.columns.end() ? 0.0 : at->second.delay_s;
}

/// A place between rows: row + share of the way to the next.
struct Place {
  std::size_t row = 0;
  double share = 0.0;
};

/// Places of moments that grow, in the rows first..last-1.
class Walk {
 public:
  Walk(const std::vector<double>& time_s, std::size_t first, std::size_t last)
      : time_s_(time_s), row_(first), last_(last) {}

  Place at(double moment_s) {
    while (row_ + 1 < last_ && time_s_[row_ + 1] <= moment_s) ++row_;
    if (row_ + 1 == last_) return {row_, 0.0};
    const double share = (moment_s - time_s_[row_]) / (time_s_[row_ + 1] - time_s_[row_]);
    // Delays of whole rows take whole rows, though stamps are rounded.
    constexpr double rounded = 1e-3;
    if (share > 1.0 - rounded) return {row_ + 1, 0.0};
    return {row_, share < rounded ? 0.0 : share};
  }

 private:
  const std::vector<double>& time_s_;
  std::size_t row_, last_;
};

double between(const std::vector<double>& values, const Place& place) {
  if (place.share == 0.0) return values[place.row];
  return values[place.row] + place.share * (values[place.row + 1] - values[place.row]);
}

struct Delays {
  double voltage_s, cart_s, theta_s;
  double largest() const { return std::max({voltage_s, cart_s, theta_s}); }
};

/// Appends what is left of the rows first..last-1.
void append_piece(const Measurement& run, const Delays& delays, std::size_t first, std::size_t last,
                  Measurement& kept) {
  const double until_s = run.time_s[last - 1] - delays.largest() + 1e-9;
  Walk voltage(run.time_s, first, last), cart(run.time_s, first, last), theta(run.time_s, first, last);
  if (kept.size() > 0 && run.time_s[first] <= until_s) kept.breaks.push_back(kept.size());
  for (std::size_t k = first; k < last && run.time_s[k] <= until_s; ++k) {
    kept.time_s.push_back(run.time_s[k]);
    if (!run.voltage_v.empty())
      kept.voltage_v.push_back(run.voltage_v[voltage.at(run.time_s[k] + delays.voltage_s).row]);
    const Place x = cart.at(run.time_s[k] + delays.cart_s), a = theta.at(run.time_s[k] + delays.theta_s);
    if (run.has_cart()) kept.cart_m.push_back(between(run.cart_m, x));
    if (run.has_theta()) kept.theta_rad.push_back(between(run.theta_rad, a));
    if (!run.cart_weight.empty()) kept.cart_weight.push_back(run.cart_weight[x.row]);
    if (!run.theta_weight.empty()) kept.theta_weight.push_back(run.theta_weight[a.row]);
  }
}

}  // namespace

void undo_delays(Measurement& run, const Dataset& dataset) {
  const Delays delays{delay_of(dataset, "voltage_v"), delay_of(dataset, "cart_m"),
                      delay_of(dataset, "theta_rad")};
  if (delays.largest() == 0.0) return;
  Measurement kept;
  for (std::size_t piece = 0; piece <= run.breaks.size(); ++piece)
    append_piece(run, delays, piece == 0 ? 0 : run.breaks[piece - 1],
                 piece < run.breaks.size() ? run.breaks[piece] : run.size(), kept);
  constexpr std::size_t min_samples = 10;
  if (kept.size() < min_samples)
    throw ConfigError(dataset.file.string() + " is too short for a delay_s of " +
                      exact_text(delays.largest()) +
                      " s: check that delay_s is in seconds, or record a longer run");
  run.time_s = std::move(kept.time_s);
  run.voltage_v = std::move(kept.voltage_v);
  run.cart_m = std::move(kept.cart_m);
  run.theta_rad = std::move(kept.theta_rad);
  run.cart_weight = std::move(kept.cart_weight);
  run.theta_weight = std::move(kept.theta_weight);
  run.breaks = std::move(kept.breaks);
  // What was added is in the angle, and its rows are others now.
  run.unfoldings.clear();
}

}  // namespace upright
