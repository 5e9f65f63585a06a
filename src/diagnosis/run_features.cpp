#include "run_features.hpp"

#include <algorithm>
#include <array>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <charconv>
#include <chrono>
#include <cmath>
#include <map>
#include <string_view>

#include "measurement/dataset_file.hpp"

namespace upright {

namespace {

/// A feature of the runs.
struct RunFeature {
  std::string name;
  std::vector<double> numbers;     ///< empty: a label that is not a number for each run
  std::vector<std::string> texts;  ///< of a label
};

double mean_position(const Measurement& run) {
  double sum = 0.0;
  for (const double x : run.cart_m) sum += x;
  return sum / std::max(1.0, static_cast<double>(run.cart_m.size()));
}

double stroke(const Measurement& run) {
  if (run.cart_m.empty()) return 0.0;
  const auto [low, high] = std::minmax_element(run.cart_m.begin(), run.cart_m.end());
  return *high - *low;
}

/// The way from the first place to the last, as a share of all travel.
double direction(const Measurement& run) {
  double travel = 0.0;
  for (std::size_t k = 1; k < run.cart_m.size(); ++k) travel += std::abs(run.cart_m[k] - run.cart_m[k - 1]);
  return travel > 0.0 ? (run.cart_m.back() - run.cart_m.front()) / travel : 0.0;
}

double voltage(const Measurement& run) {
  double square = 0.0;
  for (const double v : run.voltage_v) square += v * v;
  return std::sqrt(square / std::max(1.0, static_cast<double>(run.voltage_v.size())));
}

/// What a record itself shows.
struct Recorded {
  const char* name;
  double (*of)(const Measurement&);
};

constexpr std::array recorded_features = {
    Recorded{"the place on the track", mean_position}, Recorded{"the stroke", stroke},
    Recorded{"the direction of travel", direction}, Recorded{"the voltage", voltage}};

const std::map<std::string, std::string>& labels_of(const Measurement& run) {
  static const std::map<std::string, std::string> none;
  return run.dataset ? run.dataset->labels : none;
}

/// One label of all runs, or nothing if a run lacks it.
std::optional<RunFeature> label_feature(const std::string& label,
                                        const std::vector<const Measurement*>& runs) {
  RunFeature feature;
  feature.name = label == "recorded" ? "the time of recording" : "the label " + label;
  for (const Measurement* run : runs) {
    const auto at = labels_of(*run).find(label);
    if (at == labels_of(*run).end() || at->second.empty()) return std::nullopt;
    feature.texts.push_back(at->second);
    if (const auto number = label_number(at->second)) feature.numbers.push_back(*number);
  }
  if (feature.numbers.size() < runs.size()) feature.numbers.clear();
  return feature;
}

std::vector<RunFeature> features_of(const std::vector<const Measurement*>& runs) {
  std::vector<RunFeature> features;
  for (const Recorded& recorded : recorded_features) {
    RunFeature feature{recorded.name, {}, {}};
    for (const Measurement* run : runs) feature.numbers.push_back(recorded.of(*run));
    features.push_back(feature);
  }
  for (const auto& [label, text] : labels_of(*runs.front()))
    if (const auto feature = label_feature(label, runs)) features.push_back(*feature);
  return features;
}

/// The sum of the squares about the mean.
double scatter(const Eigen::ArrayXd& values) {
  return (values - values.mean()).square().sum();
}

/// The probability of such a correlation by chance (t test of the slope of a line). Empty if there are too
/// few runs or no numbers, or if all have the same number.
std::optional<double> chance_of_line(const std::vector<double>& numbers, const Eigen::VectorXd& sizes) {
  const auto n = static_cast<Eigen::Index>(numbers.size());
  const double freedom = static_cast<double>(n) - 2.0;
  if (freedom < 2.0) return std::nullopt;
  const Eigen::Map<const Eigen::ArrayXd> x(numbers.data(), n);
  constexpr double rounding = 1e-9;  // of numbers that are the same
  const double scale = std::sqrt(scatter(x) * scatter(sizes.array()));
  if (!(scatter(x) > rounding * rounding * x.square().sum()) || !(scale > 0.0)) return std::nullopt;
  const double product = ((x - x.mean()) * (sizes.array() - sizes.mean())).sum();
  const double r = std::clamp(product / scale, -1.0 + 1e-12, 1.0 - 1e-12);
  const double t = std::abs(r) * std::sqrt(freedom / (1.0 - r * r));
  return 2.0 * cdf(complement(boost::math::students_t(freedom), t));
}

/// The probability that groups of runs with the same text differ so much by chance (one-way analysis of
/// variance). Empty if there are no texts, one group, or fewer than two runs more than groups.
std::optional<double> chance_of_groups(const std::vector<std::string>& texts, const Eigen::VectorXd& sizes) {
  std::map<std::string, std::vector<double>> groups;
  for (std::size_t i = 0; i < texts.size(); ++i)
    groups[texts[i]].push_back(sizes[static_cast<Eigen::Index>(i)]);
  const double between_freedom = static_cast<double>(groups.size()) - 1.0;
  const double within_freedom = static_cast<double>(texts.size() - groups.size());
  if (between_freedom < 1.0 || within_freedom < 2.0) return std::nullopt;
  double within = 0.0;
  for (const auto& [text, values] : groups)
    within += scatter(Eigen::Map<const Eigen::ArrayXd>(values.data(), std::ssize(values)));
  const double all = scatter(sizes.array());
  if (!(all > 0.0)) return std::nullopt;
  within = std::max(within, 1e-24 * all);
  const double f = ((all - within) / between_freedom) / (within / within_freedom);
  return cdf(complement(boost::math::fisher_f(between_freedom, within_freedom), std::max(f, 0.0)));
}

/// Whether `text` is a date, or a date and a time with or without seconds, as in "2026-03-07 10:30:00".
bool is_date_or_time(std::string_view text) {
  constexpr std::string_view form = "0000-00-00 00:00:00";
  constexpr std::array<std::size_t, 3> lengths = {10, 16, 19};
  const auto fits = [](char letter, char wanted) {
    if (wanted == '0') return letter >= '0' && letter <= '9';
    return letter == wanted || (wanted == ' ' && letter == 'T');
  };
  return std::ranges::count(lengths, text.size()) == 1 &&
         std::equal(text.begin(), text.end(), form.begin(), fits);
}

}  // namespace

std::vector<RunDependence> dependences_of(const Eigen::VectorXd& sizes,
                                          const std::vector<const Measurement*>& runs) {
  constexpr double max_chance = 0.05;  // of any feature
  double tests = 0.0;
  std::vector<RunDependence> found;
  for (const RunFeature& feature : features_of(runs)) {
    double least = 1.0;
    for (const auto& chance :
         {chance_of_line(feature.numbers, sizes), chance_of_groups(feature.texts, sizes)}) {
      if (!chance) continue;
      tests += 1.0;
      least = std::min(least, *chance);
    }
    if (least < 1.0) found.push_back({feature.name, feature.texts, least});
  }
  std::erase_if(found, [&](const RunDependence& d) { return d.chance * tests > max_chance; });
  std::stable_sort(found.begin(), found.end(),
                   [](const RunDependence& a, const RunDependence& b) { return a.chance < b.chance; });
  return found;
}

std::optional<double> label_number(std::string_view text) {
  double number = 0.0;
  const char* end = text.data() + text.size();
  if (const auto read = std::from_chars(text.data(), end, number); read.ec == std::errc{} && read.ptr == end)
    return std::isfinite(number) ? std::optional(number) : std::nullopt;
  const std::string_view time = text.ends_with('Z') ? text.substr(0, text.size() - 1) : text;
  if (!is_date_or_time(time)) return std::nullopt;
  const auto field = [&time](std::size_t at, std::size_t digits) {
    int value = 0;
    if (at < time.size()) std::from_chars(&time[at], &time[at] + digits, value);
    return value;
  };
  const int hour = field(11, 2), minute = field(14, 2), second = field(17, 2);
  const std::chrono::year_month_day date = std::chrono::year(field(0, 4)) / field(5, 2) / field(8, 2);
  if (!date.ok() || hour > 23 || minute > 59 || second > 60) return std::nullopt;
  const double days = std::chrono::sys_days(date).time_since_epoch().count();
  return 24.0 * days + hour + minute / 60.0 + second / 3600.0;
}

}  // namespace upright
