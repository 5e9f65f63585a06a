#include "data_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <optional>
#include <utility>

#include "base/angle_units.hpp"
#include "base/median.hpp"
#include "base/parallel.hpp"
#include "column_timing.hpp"
#include "data_hypotheses.hpp"
#include "dataset_file.hpp"
#include "folded_angle.hpp"
#include "time_stamps.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

/// Data as they are may contradict an equation that accounts for less than this share of them, with all
/// freedom for what may differ from the plant file.
constexpr double contradicts = 0.9;
/// A mistake undone explains what was contradicted if it accounts for as much, and leaves a fifth at most of
/// what was left before.
constexpr double explains = 0.75, far_better = 5.0;
/// An equation of which nothing shows in the data as they are must account for this share.
constexpr double min_share_alone = 0.5;
/// Nor may another equation lose more than this by it.
constexpr double as_well = 0.05;
/// No record of such a rig has rows further apart.
constexpr double longest_period_s = 0.1, shortest_period_s = 1e-5;
/// Motion that needs so many times the recorded voltage even with a quarter of the mass is none of this rig.
constexpr double implausible_voltage = 10.0;
/// Data of which an equation accounts for less than this share are of another rig, or of none.
constexpr double hardly_any = 0.3;
/// No cart on a track travels further, and none of these rigs moves faster for half of a record.
constexpr double longest_travel_m = 20.0, fastest_cart_mps = 20.0, fastest_pendulum_radps = 100.0;
/// No motor of such a rig moves its cart at less [V]: a voltage that would be smaller is not in millivolts.
constexpr double min_driving_v = 0.1;
/// Mistakes at once that are looked for; each more must leave a fifth of what is left over without it.
/// Columns that are swapped have one more mistake at most, since many swaps fit something.
constexpr std::size_t max_mistakes = 3, max_beside_swap = 1;
const double worth_of_mistake = std::log(far_better);
/// Of readings that leave nearly the same, the one that is listed first is taken; those that leave no more
/// than twice as much may be right too.
const double clearly_less = std::log(1.1), may_be_right = std::log(2.0);

constexpr std::string_view quantity_of[] = {"voltage_v", "cart_m", "theta_rad"};

/// A mistake of one kind, undone. Of a kind there is one at most.
struct Correction {
  int kind;
  std::string words;
  std::function<void(DataReading&)> apply;
};

/// What was unfolded and folded again is whole but for rounding.
bool all_whole(const std::vector<double>& values) {
  constexpr double whole = 1e-6;
  return std::all_of(values.begin(), values.end(),
                     [](double v) { return std::abs(v - std::round(v)) < whole; });
}

double largest(const std::vector<double>& values) {
  double found = 0.0;
  for (const double v : values) found = std::max(found, std::abs(v));
  return found;
}

std::string text(const char* format, double value) {
  char buffer[200];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

class MistakeSearch {
 public:
  MistakeSearch(const Measurement& run, const Plant& plant) : judge_(run, plant), fold_(judge_.fold()) {
    list();
  }

  /// The reading that undoes what is wrong; nothing where nothing is certain.
  std::optional<DataReading> resolve() {
    as_read_ = judge_.judge({});
    const bool bad_time = judge_.period_s() > longest_period_s || judge_.period_s() < shortest_period_s;
    const auto late = with_lateness(judge_, {});
    if (bad_time || fold_ || bad(as_read_.cart) || bad(as_read_.pendulum)) {
      for (std::size_t count = 1; count <= max_mistakes; ++count) combine({}, 0, count);
      if (late) consider(*late, {lateness});
    }
    if (!fitting_.empty() && best().kinds != std::vector<int>{lateness}) {
      const DataReading reading = best().reading;
      return with_lateness(judge_, reading).value_or(reading);
    }
    return late ? late : only_folded();
  }

  const ExplainedShares& as_read() const { return as_read_; }
  /// Other readings that may be right instead, the best of each set of mistakes.
  std::vector<DataReading> alternatives() const {
    std::vector<DataReading> others;
    for (const Fitting& f : fitting_)
      if (&f != &best() && f.rank < best().rank + may_be_right) others.push_back(f.reading);
    return others;
  }

 private:
  enum Kind {
    lateness,
    folding,
    order,
    time,
    voltage_sign,
    cart_sign,
    theta_sign,
    theta_zero,
    voltage_unit,
    cart_unit,
    theta_unit
  };

  static bool bad(const std::optional<double>& accounted) { return accounted && *accounted < contradicts; }

  void add(int kind, std::string words, std::function<void(DataReading&)> apply) {
    corrections_.push_back({kind, std::move(words), std::move(apply)});
  }

  void add_factor(int kind, std::size_t channel, double factor, std::string words) {
    add(kind, std::move(words), [channel, factor](DataReading& r) { r.factor[channel] *= factor; });
  }

  /// An angle jumps by no whole part of a turn, whatever else may be wrong.
  std::optional<DataReading> only_folded() const {
    if (!fold_) return std::nullopt;
    DataReading reading;
    reading.fold = *fold_;
    constexpr double more_than_any_in_rad = 10.0;
    if (*fold_ > more_than_any_in_rad) {
      reading.factor[theta_channel] = radians_per_degree;
      reading.mistakes.emplace_back("theta_rad is in degrees");
    }
    reading.mistakes.push_back(folded_words());
    return reading;
  }

  std::string folded_words() const {
    return text("theta_rad is folded: it jumps by %.4g from one row to the next", *fold_);
  }

  void list() {
    if (fold_) add(folding, folded_words(), [every = *fold_](DataReading& r) { r.fold = every; });
    if (is_mirrored())
      add(folding, "theta_rad is mirrored at an end of its range, like an absolute value",
          [](DataReading& r) { r.mirrored = true; });
    const bool cart = judge_.has(cart_channel), theta = judge_.has(theta_channel);
    const bool driven = cart && judge_.has(voltage_channel);
    if (driven)
      add_factor(voltage_sign, voltage_channel, -1.0,
                 theta ? "voltage_v has the wrong sign"
                       : "voltage_v has the wrong sign (or cart_m has: these data do not show which)");
    if (driven && theta) add_factor(cart_sign, cart_channel, -1.0, "cart_m has the wrong sign");
    if (cart && theta) add_factor(theta_sign, theta_channel, -1.0, "theta_rad has the wrong sign");
    if (theta)
      add(theta_zero, "theta_rad is zero where the pendulum hangs instead of upright",
          [](DataReading& r) { r.theta_offset_rad += std::numbers::pi; });
    list_units(cart, theta, driven);
    list_orders(cart, theta, driven);
  }

  bool is_mirrored() const {
    if (!judge_.has(theta_channel)) return false;
    std::vector<double> angle = judge_.raw(theta_channel);
    return unmirror(angle) > 0;
  }

  /// Of any column, since they may be swapped.
  double largest_number() const {
    double found = 0.0;
    for (std::size_t c = 0; c < channels; ++c)
      if (judge_.has(c)) found = std::max(found, largest(judge_.raw(c)));
    return found;
  }

  void list_units(bool cart, bool theta, bool driven) {
    for (const auto& [factor, unit] : {std::pair{1e-3, "milliseconds"}, std::pair{1e-6, "microseconds"}}) {
      const double period_s = judge_.period_s() * factor;
      if (judge_.period_s() <= longest_period_s || period_s > longest_period_s ||
          period_s < shortest_period_s)
        continue;
      add(time, std::string("time_s is in ") + unit,
          [factor = factor](DataReading& r) { r.time_factor = factor; });
    }
    constexpr double millivolt_v = 1e-3;
    if (driven && millivolt_v * largest_number() >= min_driving_v)
      add_factor(voltage_unit, voltage_channel, millivolt_v, "voltage_v is in millivolts");
    if (cart) {
      add_factor(cart_unit, cart_channel, 1e-3, "cart_m is in millimetres");
      add_factor(cart_unit, cart_channel, 1e-2, "cart_m is in centimetres");
      list_cart_counts();
    }
    if (!theta) return;
    add_factor(theta_unit, theta_channel, radians_per_degree, "theta_rad is in degrees");
    add_factor(theta_unit, theta_channel, 2.0 * std::numbers::pi, "theta_rad is in turns");
    if (all_whole(judge_.raw(theta_channel)))
      for (const int counts : {4096, 2048, 1024, 8192, 16384, 1000, 2000, 4000, 5000, 10000})
        add_factor(theta_unit, theta_channel, 2.0 * std::numbers::pi / counts,
                   "theta_rad is in counts of about 1/" + std::to_string(counts) +
                       " turn (use the exact number of your encoder)");
  }

  void list_cart_counts() {
    if (!all_whole(judge_.raw(cart_channel))) return;
    constexpr int steps = 24, a_decade = 8;  // a third more each
    for (int i = 0; i <= steps; ++i) {
      const double factor = 1e-6 * std::pow(10.0, static_cast<double>(i) / a_decade);
      add_factor(cart_unit, cart_channel, factor,
                 text("cart_m is in counts of about %.2g m (use the exact number of your encoder)", factor));
    }
  }

  void list_orders(bool cart, bool theta, bool driven) {
    const auto swap = [&](std::size_t a, std::size_t b) {
      add(order, std::string(quantity_of[a]) + " and " + std::string(quantity_of[b]) + " are swapped",
          [a, b](DataReading& r) { std::swap(r.column[a], r.column[b]); });
    };
    if (cart && theta) swap(cart_channel, theta_channel);
    if (driven) swap(voltage_channel, cart_channel);
    if (driven && theta) {
      swap(voltage_channel, theta_channel);
      for (const bool forwards : {false, true})
        add(order, "voltage_v, cart_m and theta_rad are interchanged", [forwards](DataReading& r) {
          r.column = forwards ? std::array<std::size_t, channels>{1, 2, 0}
                              : std::array<std::size_t, channels>{2, 0, 1};
        });
    }
  }

  /// Tries every set of `count` more corrections of different kinds.
  void combine(const DataReading& reading, std::size_t from, std::size_t count) {
    if (count == 0) return consider(reading, used_);
    for (std::size_t i = from; i < corrections_.size(); ++i) {
      const Correction& correction = corrections_[i];
      if (std::find(used_.begin(), used_.end(), correction.kind) != used_.end()) continue;
      if (correction.kind == order && used_.size() + count > 1 + max_beside_swap) continue;
      DataReading next = reading;
      correction.apply(next);
      next.mistakes.push_back(correction.words);
      used_.push_back(correction.kind);
      combine(next, i + 1, count - 1);
      used_.pop_back();
    }
  }

  /// Whether an equation bears the reading out, or as well as the data as they are.
  static bool undoes(const std::optional<double>& had, const std::optional<double>& has) {
    if (!has) return !had;
    if (!had) return *has >= min_share_alone;
    return *has >= explains || *has >= *had - as_well;
  }

  /// Whether it explains what is contradicted otherwise.
  static bool settles(const std::optional<double>& had, const std::optional<double>& has) {
    if (!has || *has < explains) return false;
    return !had || (bad(had) && 1.0 - *had >= far_better * (1.0 - *has));
  }

  void consider(const DataReading& reading, const std::vector<int>& kinds) {
    const ExplainedShares now = judge_.judge(reading);
    if (!undoes(as_read_.cart, now.cart) || !undoes(as_read_.pendulum, now.pendulum)) return;
    if (!(settles(as_read_.cart, now.cart) || settles(as_read_.pendulum, now.pendulum))) return;
    const double rank = now.left_over + worth_of_mistake * static_cast<double>(reading.mistakes.size());
    // Of one set of kinds the best is kept.
    for (Fitting& f : fitting_) {
      if (f.kinds != kinds) continue;
      if (rank < f.rank - clearly_less) f = {kinds, reading, rank};
      return;
    }
    fitting_.push_back({kinds, reading, rank});
  }

  struct Fitting {
    std::vector<int> kinds;
    DataReading reading;
    double rank;
  };

  const Fitting& best() const {
    return *std::min_element(fitting_.begin(), fitting_.end(), [](const Fitting& a, const Fitting& b) {
      return a.rank < b.rank - clearly_less;
    });
  }

  ReadingJudge judge_;
  std::optional<double> fold_;
  std::vector<Correction> corrections_;
  std::vector<int> used_;
  ExplainedShares as_read_;
  std::vector<Fitting> fitting_;
};

/// The dataset file's line for a quantity as it is read now.
DatasetColumn column_now(const Measurement& run, std::string_view quantity) {
  if (run.dataset) {
    const auto at = run.dataset->columns.find(quantity);
    if (at != run.dataset->columns.end()) return at->second;
  }
  return {std::string(quantity), 1.0, 0.0, false};
}

/// A measured number without the digits that are not known: 0.002 instead of 0.00199993.
double short_number(double value) {
  constexpr double known = 2e-4;
  for (const char* format : {"%.1g", "%.2g", "%.3g", "%.4g"}) {
    const double shorter = std::stod(text(format, value));
    if (std::abs(shorter - value) <= known * value) return shorter;
  }
  return value;
}

std::vector<std::string> lines_of(const Measurement& run, const DataReading& reading) {
  std::vector<std::string> lines;
  if (reading.time_factor != 1.0 || reading.steady_period_s > 0.0) {
    DatasetColumn column = column_now(run, "time_s");
    column.scale *= reading.time_factor;
    column.offset *= reading.time_factor;
    if (reading.steady_period_s > 0.0) column.period_s = short_number(reading.steady_period_s);
    lines.push_back(column_line("time_s", column));
  }
  for (std::size_t c = 0; c < channels; ++c) {
    const double offset = c == theta_channel ? reading.theta_offset_rad : 0.0;
    const bool folds = c == theta_channel && (reading.fold != 0.0 || reading.mirrored);
    const bool as_it_is = reading.column[c] == c && reading.factor[c] == 1.0 && offset == 0.0 &&
                          reading.later_s[c] == 0.0 && !folds;
    if (as_it_is) continue;
    DatasetColumn column = column_now(run, quantity_of[reading.column[c]]);
    column.scale *= reading.factor[c];
    column.offset = column.offset * reading.factor[c] + offset;
    constexpr double steps_per_s = 1e4;
    column.delay_s += std::round(reading.later_s[c] * steps_per_s) / steps_per_s;
    if (c != theta_channel) column.folded_every_rad = DatasetColumn{}.folded_every_rad;
    if (c == theta_channel && reading.fold != 0.0) column.folded_every_rad = folded_every_rad(reading);
    if (c == theta_channel && reading.mirrored) column.mirrored = true;
    lines.push_back(column_line(quantity_of[c], column));
  }
  return lines;
}

std::string joined(const std::vector<std::string>& parts, const char* between) {
  std::string all;
  for (const std::string& part : parts) all += (all.empty() ? "" : between) + part;
  return all;
}

/// The reading with a steady clock, where the stamps scatter about one.
std::optional<DataReading> with_steady_clock(const Measurement& run, std::optional<DataReading> reading) {
  const auto scatter = find_scatter(run);
  if (!scatter) return reading;
  DataReading steady = reading.value_or(DataReading{});
  steady.steady_period_s = scatter->period_s * steady.time_factor;
  char words[200];
  std::snprintf(words, sizeof words,
                "time_s scatters by %.3g ms around a steady clock of %.4g ms, which the motion follows",
                1e3 * scatter->scatter_s * steady.time_factor, 1e3 * short_number(steady.steady_period_s));
  steady.mistakes.emplace_back(words);
  return steady;
}

/// Median of the steps' sizes over their times.
double usual_rate(const Measurement& run, const std::vector<double>& values) {
  std::vector<double> rates;
  for (std::size_t k = 1; k < values.size(); ++k)
    rates.push_back(std::abs(values[k] - values[k - 1]) / (run.time_s[k] - run.time_s[k - 1]));
  if (rates.empty()) return 0.0;
  return median_of(std::move(rates));
}

/// What no such rig does, in words; empty where it may be a rig.
std::string implausible(const Measurement& run) {
  double travel_m = 0.0;
  if (run.has_cart()) {
    const auto [smallest, largest] = std::minmax_element(run.cart_m.begin(), run.cart_m.end());
    travel_m = *largest - *smallest;
  }
  if (travel_m > longest_travel_m)
    return text("cart_m travels %.3g m, which is impossible for such a rig", travel_m);
  const double cart_mps = usual_rate(run, run.cart_m), pendulum_radps = usual_rate(run, run.theta_rad);
  if (cart_mps > fastest_cart_mps)
    return text("cart_m moves at %.3g m/s, which is impossible for such a rig", cart_mps);
  if (pendulum_radps > fastest_pendulum_radps)
    return text("theta_rad turns at %.3g rad/s, which is impossible for such a rig", pendulum_radps);
  return "";
}

/// What of the motion nothing accounts for, in words.
std::string unaccounted(const ExplainedShares& as_read) {
  if (as_read.cart && *as_read.cart < 0.0 && as_read.voltage_needed > implausible_voltage)
    return text(
        "the recorded motion needs %.3g times the recorded voltage even with a quarter of the plant "
        "file's mass",
        as_read.voltage_needed);
  if (as_read.cart && *as_read.cart < hardly_any)
    return text(
        "the recorded motion accounts for only %.2g %% of the recorded voltage, for any masses, friction and "
        "delays",
        100.0 * std::max(*as_read.cart, 0.0));
  if (as_read.pendulum && *as_read.pendulum < hardly_any)
    return text(
        "gravity and the cart account for only %.2g %% of the pendulum's recorded acceleration, for any "
        "length "
        "and friction",
        100.0 * std::max(*as_read.pendulum, 0.0));
  return "";
}

std::optional<DataMistake> mistake_in(const Measurement& run, const Plant& plant, std::size_t number) {
  MistakeSearch search(run, plant);
  if (const auto reading = with_steady_clock(run, search.resolve())) {
    DataMistake mistake{number, joined(reading->mistakes, ", and "), lines_of(run, *reading), {}};
    for (const DataReading& other : search.alternatives())
      mistake.or_else.push_back(joined(other.mistakes, ", and ") + " (" + joined(lines_of(run, other), "; ") +
                                ")");
    return mistake;
  }
  std::string cause = implausible(run);
  if (cause.empty()) cause = unaccounted(search.as_read());
  if (cause.empty()) return std::nullopt;
  return DataMistake{number, std::move(cause), {}, {}};
}

}  // namespace

std::vector<DataMistake> find_mistakes(const std::vector<Measurement>& runs, const Plant& plant) {
  std::vector<std::optional<DataMistake>> of_runs(runs.size());
  parallel_for(runs.size(), [&](std::size_t r) {
    if (runs[r].size() >= 2) of_runs[r] = mistake_in(runs[r], plant, r);
  });
  std::vector<DataMistake> mistakes;
  for (std::optional<DataMistake>& mistake : of_runs)
    if (mistake) mistakes.push_back(std::move(*mistake));
  return mistakes;
}

void refuse_mistakes(const std::vector<Measurement>& runs, const Plant& plant) {
  const std::vector<DataMistake> mistakes = find_mistakes(runs, plant);
  if (mistakes.empty()) return;
  const DataMistake& first = mistakes.front();
  const Measurement& run = runs[first.run];
  const std::string file = run.dataset ? run.dataset->file.string() : run.name;
  std::string others;
  for (std::size_t i = 1; i < mistakes.size(); ++i)
    others += (others.empty() ? "; the same applies to " : ", ") + runs[mistakes[i].run].name;
  const std::string remedy =
      first.lines.empty() ? "correct the columns or their scale in a dataset file "
                            "(docs/reference/dataset-files.md), or correct the plant file"
                          : "put into the columns of its dataset file (docs/reference/dataset-files.md): " +
                                joined(first.lines, "; ");
  const std::string alternatives =
      first.or_else.empty() ? "" : "; alternatively, " + joined(first.or_else, ", or ");
  throw ConfigError(file + " contradicts the plant file: " + first.cause + ": " + remedy + alternatives +
                    " (--trust-data skips this check)" + others);
}

}  // namespace upright
