#include "diagnosis_tables.hpp"

#include <algorithm>
#include <array>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <sstream>

namespace upright::blind {

namespace {

using nlohmann::json;
using Question = std::function<bool(const json&)>;

/// A goal that is not set.
constexpr double none = std::numeric_limits<double>::infinity();

/// What must hold under a condition.
struct Goals {
  const char* condition;
  const char* title;
  double right_first, right_set, false_effects, recognised;
  double median_error, ninth_error;  ///< of parameters, relative
  double covered_low, covered_high;
  double over_floor, floor_kept, both_found;
  double median_s, median_unknown_s, slowest_s;  ///< wall time of `--timing` cases
};

constexpr std::array all_goals = {
    Goals{"quantized", "quantization only", 0.98, 1.0, 0.01, 0.95, 0.01, 0.05, 0.92, 0.98, 1.05, 0.95, 0.90,
          20.0, none, none},
    Goals{"disturbed", "disturbed", 0.90, 0.98, 0.03, 0.90, 0.05, 0.15, 0.90, 0.98, 1.10, 0.95, 0.80, 20.0,
          none, none},
    Goals{"laboratory", "laboratory", 0.90, 0.98, 0.01, 0.95, 0.05, 0.15, 0.90, 0.98, 1.10, 0.95, 0.80, 5.0,
          20.0, 40.0},
};

/// Of effects that are described, this share must have a held-out gap that many times smaller.
constexpr double described_share = 0.5, described_shrinking = 3.0;

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(q * static_cast<double>(values.size())))];
}

std::string number(double value, const char* format = "%.3g") {
  char text[40];
  std::snprintf(text, sizeof text, format, value);
  return std::isnan(value) ? "-" : text;
}

struct Share {
  double hits = 0.0, count = 0.0;
  double value() const { return count > 0.0 ? hits / count : std::nan(""); }
  std::string text() const {
    if (count == 0.0) return "-";
    return number(100.0 * value(), "%.1f") + " % (" + number(hits, "%.0f") + " of " + number(count, "%.0f") +
           ")";
  }
  /// With the bound that the true share does not exceed, or does not fall below.
  std::string text_with_bound(bool upper) const {
    if (count == 0.0) return "-";
    const double bound = upper ? upper_bound(*this) : lower_bound(*this);
    return text() + (upper ? ", at most " : ", at least ") + number(100.0 * bound, "%.1f") + " %";
  }
  static double upper_bound(const Share& share) { return share_upper_bound(share.hits, share.count); }
  static double lower_bound(const Share& share) { return share_lower_bound(share.hits, share.count); }
};

Share share_of(const Records& records, const Question& counts, const Question& hits) {
  Share share;
  for (const json& r : records) {
    if (!counts(r)) continue;
    share.count += 1.0;
    share.hits += hits(r) ? 1.0 : 0.0;
  }
  return share;
}

struct Figure {
  std::string name, goal, measured;
  bool known = false, holds = false;
};

Figure share_figure(const std::string& name, const Share& share, double goal, bool is_lower_bound = true) {
  Figure figure{name, (is_lower_bound ? ">= " : "<= ") + number(100.0 * goal) + " %",
                share.text_with_bound(!is_lower_bound)};
  figure.known = share.count > 0.0;
  figure.holds = is_lower_bound ? share.value() >= goal : share.value() <= goal;
  return figure;
}

Figure level_figure(const std::string& name, double value, double goal, const std::string& unit,
                    double scale) {
  Figure figure{name, goal == none ? "" : "<= " + number(goal * scale) + unit, number(value * scale) + unit};
  figure.known = !std::isnan(value) && goal != none;
  figure.holds = value <= goal;
  return figure;
}

Figure coverage_figure(const Share& share, double low, double high) {
  Figure figure{"95 % intervals that contain the true value",
                number(100.0 * low) + "-" + number(100.0 * high) + " %", share.text()};
  figure.known = share.count > 0.0;
  figure.holds = share.value() >= low && share.value() <= high;
  return figure;
}

bool shown_single(const json& r) {
  return is_single(r) && is_shown(r);
}

bool clear_single(const json& r) {
  return shown_single(r) && is_distinguishable(r);
}

bool shown_unknown(const json& r) {
  return is_unknown(r) && is_shown(r);
}

/// A case with a diagnosis and nothing hidden.
bool answered_null(const json& r) {
  return is_null(r) && !is_failed(r);
}

bool described_unknown(const json& r) {
  return shown_unknown(r) && is_described(r);
}

bool is_described_well(const json& r) {
  return shrinking_of(r) >= described_shrinking;
}

/// A gap is 1 at the noise floor, so a smaller one than this cannot shrink so much.
bool may_be_described_well(const json& r) {
  return described_unknown(r) && number_in(r, "gap_before") >= described_shrinking;
}

Records of_condition(const Records& records, const std::string& condition, bool timing = false) {
  Records chosen;
  for (const json& r : records)
    if (condition_of(r) == condition && is_timing(r) == timing) chosen.push_back(r);
  return chosen;
}

std::vector<Figure> estimate_figures(const Records& records, const Goals& goals) {
  std::vector<double> errors;
  Share covered;
  for (const json& r : records) {
    if (!shown_single(r) || !is_right_first(r)) continue;
    for (const Estimate& e : estimates_of(r)) {
      errors.push_back(e.error);
      covered.count += 1.0;
      covered.hits += e.covered ? 1.0 : 0.0;
    }
  }
  return {
      level_figure("parameter error, median", quantile(errors, 0.5), goals.median_error, " %", 100.0),
      level_figure("parameter error, 90th percentile", quantile(errors, 0.9), goals.ninth_error, " %", 100.0),
      coverage_figure(covered, goals.covered_low, goals.covered_high)};
}

std::vector<Figure> floor_figures(const Records& records, const Goals& goals) {
  std::vector<double> over_floor;
  Share kept;
  for (const json& r : records) {
    if (is_unknown(r) || !is_shown(r)) continue;
    kept.count += 1.0;
    if (is_failed(r) || !has_number(r, "over_floor")) continue;
    over_floor.push_back(r.at("over_floor"));
    kept.hits += over_floor.back() <= goals.over_floor ? 1.0 : 0.0;
  }
  return {level_figure("held-out error relative to the true model's floor, median", quantile(over_floor, 0.5),
                       goals.over_floor, "", 1.0),
          share_figure("held-out error within the limit above", kept, goals.floor_kept)};
}

/// A timing case that failed took longer than any.
std::vector<Figure> time_figures(const Records& timing, const Goals& goals) {
  std::vector<double> known, unknown, all;
  for (const json& r : timing) {
    const double wall_s = is_failed(r) ? none : r.at("wall_s").get<double>();
    (is_unknown(r) ? unknown : known).push_back(wall_s);
    all.push_back(wall_s);
  }
  return {level_figure("time of a timing case, median", quantile(known, 0.5), goals.median_s, " s", 1.0),
          level_figure("the same, with something unknown", quantile(unknown, 0.5), goals.median_unknown_s,
                       " s", 1.0),
          level_figure("the same, slowest of all", quantile(all, 1.0), goals.slowest_s, " s", 1.0)};
}

std::vector<Figure> figures_of(const Records& records, const Records& timing, const Goals& goals) {
  std::vector<Figure> figures = {
      share_figure("right effect named first (visible and distinguishable effects)",
                   share_of(records, clear_single, is_right_first), goals.right_first),
      share_figure("right set, including effects declared as confusable",
                   share_of(records, shown_single, is_right_set), goals.right_set),
      share_figure("false effect in cases without a hidden effect",
                   share_of(records, answered_null, names_a_structure), goals.false_effects, false),
      share_figure("unknown effect recognised (described or unexplained)",
                   share_of(records, shown_unknown, is_recognised), goals.recognised),
      share_figure("unknown effect described: held-out gap at least 3 times smaller",
                   share_of(records, described_unknown, is_described_well), described_share),
      share_figure("the same, if the gap was at least 3 times the noise floor before",
                   share_of(records, may_be_described_well, is_described_well), described_share)};
  const auto add = [&](const std::vector<Figure>& more) {
    figures.insert(figures.end(), more.begin(), more.end());
  };
  add(estimate_figures(records, goals));
  add(floor_figures(records, goals));
  figures.push_back(
      share_figure("both of two hidden effects found",
                   share_of(
                       records, [](const json& r) { return is_pair(r) && is_shown(r); }, names_both),
                   goals.both_found));
  figures.push_back(share_figure(
      "completed without a failure",
      share_of(
          records, [](const json&) { return true; }, [](const json& r) { return !is_failed(r); }),
      1.0));
  add(time_figures(timing, goals));
  return figures;
}

/// Conditions of which there are records.
std::vector<Goals> measured_conditions(const Records& records) {
  std::vector<Goals> measured;
  for (const Goals& goals : all_goals)
    if (std::any_of(records.begin(), records.end(),
                    [&](const json& r) { return condition_of(r) == goals.condition; }))
      measured.push_back(goals);
  return measured;
}

void write_header(std::ostringstream& out, const std::string& first, const std::vector<Goals>& conditions,
                  bool with_goals) {
  std::string rule = "|---|";
  out << "| " << first;
  for (const Goals& goals : conditions) {
    out << (with_goals ? " | must be | " : " | ") << goals.title << (with_goals ? " | " : "");
    rule += with_goals ? "---|---|---|" : "---|";
  }
  out << " |\n" << rule << "\n";
}

void write_figures(std::ostringstream& out, const Records& records) {
  const std::vector<Goals> conditions = measured_conditions(records);
  std::vector<std::vector<Figure>> columns;
  for (const Goals& goals : conditions)
    columns.push_back(figures_of(of_condition(records, goals.condition),
                                 of_condition(records, goals.condition, true), goals));
  if (columns.empty()) return;
  write_header(out, "figure", conditions, true);
  for (std::size_t i = 0; i < columns[0].size(); ++i) {
    out << "| " << columns[0][i].name;
    for (const auto& column : columns)
      out << " | " << column[i].goal << " | " << column[i].measured << " | "
          << (!column[i].known  ? ""
              : column[i].holds ? "holds"
                                : "**missed**");
    out << " |\n";
  }
}

struct Count {
  std::string name;
  Question counts, hits;
};

std::vector<Count> counts_of_effects() {
  const auto structure = [](std::size_t more_than) {
    return [=](const json& r) { return structural_effects(r) > more_than; };
  };
  return {
      {"hidden effects that are visible in the data", is_single, is_shown},
      {"of these, with the same force as another effect", shown_single, is_same_force},
      {"of these, not distinguishable from the named effect", shown_single,
       [](const json& r) { return !is_same_force(r) && !is_distinguishable(r); }},
      {"effects with the same force as another: declared as confusable",
       [](const json& r) { return shown_single(r) && is_same_force(r); }, is_right_set},
      {"right set, where the effect saves 4 times what it saves without it",
       [](const json& r) { return is_single(r) && is_clearly_shown(r); }, is_right_set},
      {"invisible effects: a structural effect named",
       [](const json& r) { return is_single(r) && !is_shown(r); }, structure(0)},
      {"a structural effect in addition to the right one",
       [](const json& r) { return shown_single(r) && is_right_first(r); }, structure(1)},
      {"unknown effect: a structural effect named", shown_unknown, structure(0)},
      {"verdict described, with a known or no hidden effect", [](const json& r) { return !is_unknown(r); },
       is_described},
      {"verdict explained or no_discrepancy (known or no hidden effect)",
       [](const json& r) { return !is_unknown(r); },
       [](const json& r) { return !is_failed(r) && !is_recognised(r); }},
      {"pairs that are visible in the data", is_pair, is_shown},
  };
}

std::vector<Count> counts_of_kinds() {
  std::vector<Count> counts;
  for (const std::string size : {"weak", "typical", "strong"})
    counts.push_back({"right effect named first, " + size,
                      [=](const json& r) { return clear_single(r) && r.at("size") == size; },
                      is_right_first});
  for (const std::string campaign : {"mixed", "hanging", "upright", "cart_alone", "locked"})
    counts.push_back({"right effect named first, " + campaign,
                      [=](const json& r) { return clear_single(r) && r.value("campaign", "") == campaign; },
                      is_right_first});
  for (const bool quantised : {true, false})
    counts.push_back(
        {std::string("right set, sensors ") + (quantised ? "with" : "without") + " quantization",
         [=](const json& r) { return shown_single(r) && (r.value("cart_step_m", 1.0) > 0.0) == quantised; },
         is_right_set});
  return counts;
}

/// Of numbers of the plant file, where nothing is hidden.
Share corrections_covered(const Records& records) {
  Share covered;
  for (const json& r : records) {
    if (!answered_null(r)) continue;
    for (const Estimate& e : estimates_of(r, "file_truth")) {
      covered.count += 1.0;
      covered.hits += e.covered ? 1.0 : 0.0;
    }
  }
  return covered;
}

/// Level and largest value of a number over the cases that have it.
void write_spread(std::ostringstream& out, const std::string& what, const Records& records,
                  const std::vector<Goals>& conditions, const std::function<double(const json&)>& value) {
  out << "| " << what;
  for (const Goals& goals : conditions) {
    std::vector<double> values;
    for (const json& r : of_condition(records, goals.condition)) {
      const double v = value(r);
      if (std::isfinite(v)) values.push_back(v);
    }
    out << " | " << number(quantile(values, 0.5)) << ", " << number(quantile(values, 0.9)) << ", "
        << number(quantile(values, 1.0));
  }
  out << " |\n";
}

void write_spreads(std::ostringstream& out, const Records& records) {
  const std::vector<Goals> conditions = measured_conditions(records);
  out << "\nMedian, 90th percentile and largest value over cases with a result:\n\n";
  write_header(out, "value", conditions, false);
  const auto field = [](const char* name) { return [=](const json& r) { return number_in(r, name); }; };
  const auto ratio = [](const char* above, const char* below) {
    return [=](const json& r) { return number_in(r, above) / number_in(r, below); };
  };
  const auto of = [](const Question& asked, const std::function<double(const json&)>& value) {
    return [=](const json& r) { return asked(r) ? value(r) : std::nan(""); };
  };
  const auto row = [&](const std::string& what, const std::function<double(const json&)>& value) {
    write_spread(out, what, records, conditions, value);
  };
  row("processor time of a diagnosis [s]", field("cpu_s"));
  row("processor time, unknown effects [s]", of(is_unknown, field("cpu_s")));
  row("unknown effects: held-out gap, times smaller", of(shown_unknown, shrinking_of));
  row("described effects: held-out gap, times smaller", of(described_unknown, shrinking_of));
  row("error on a run that was not given, relative to the plant file's",
      ratio("fresh_after", "fresh_before"));
  row("the same, unknown effects", of(is_unknown, ratio("fresh_after", "fresh_before")));
  row("error on a run that was not given, relative to the true model's",
      of([](const json& r) { return !is_unknown(r); }, ratio("fresh_after", "fresh_truth")));
  std::vector<double> cpu;
  for (const json& r : records)
    if (is_timing(r) && !is_failed(r)) cpu.push_back(r.at("cpu_s"));
  if (!cpu.empty())
    out << "\nTiming cases: median " << number(quantile(cpu, 0.5)) << ", largest "
        << number(quantile(cpu, 1.0)) << " CPU seconds in " << cpu.size() << " cases.\n";
}

void write_counts(std::ostringstream& out, const Records& records) {
  const std::vector<Goals> conditions = measured_conditions(records);
  out << "\n";
  write_header(out, "other counts", conditions, false);
  std::vector<Count> counts = counts_of_effects();
  for (const Count& more : counts_of_kinds()) counts.push_back(more);
  for (const Count& count : counts) {
    out << "| " << count.name;
    for (const Goals& goals : conditions)
      out << " | " << share_of(of_condition(records, goals.condition), count.counts, count.hits).text();
    out << " |\n";
  }
  out << "| 95 % intervals of corrected numbers that contain the true value (nothing hidden)";
  for (const Goals& goals : conditions)
    out << " | " << corrections_covered(of_condition(records, goals.condition)).text();
  out << " |\n";
}

std::string answer_of(const json& r) {
  if (is_failed(r)) return "(failed)";
  if (is_unknown(r) && is_recognised(r)) return "(" + r.at("verdict").get<std::string>() + ")";
  if (is_null(r) && !names_a_structure(r)) return "none";
  return first_named(r);
}

void write_confusion(std::ostringstream& out, const Records& records, const Goals& goals) {
  std::map<std::string, std::map<std::string, int>> counts;
  for (const json& r : of_condition(records, goals.condition))
    if (!is_pair(r) && is_shown(r)) counts[first_hidden(r)][answer_of(r)] += 1;
  if (counts.empty()) return;
  out << "\n## Hidden and first-named effects, " << goals.title
      << "\n\nSingle visible effects: for each hidden effect, how often which effect was named "
         "first.\n\n"
         "| hidden | right | named instead |\n|---|---|---|\n";
  for (const auto& [hidden, named] : counts) {
    int total = 0, right = 0;
    std::string others;
    for (const auto& [name, count] : named) {
      total += count;
      if (name == hidden || name == "(unexplained)" || name == "(described)") {
        right += count;
      } else {
        others += (others.empty() ? "" : ", ") + name + " " + std::to_string(count);
      }
    }
    out << "| " << hidden << " | " << right << " of " << total << " | " << others << " |\n";
  }
}

bool is_missed(const json& r) {
  if (is_failed(r)) return true;
  if (is_unknown(r)) return is_shown(r) && !is_recognised(r);
  if (is_null(r)) return names_a_structure(r) || r.at("verdict") == "unexplained";
  if (is_pair(r)) return is_shown(r) && !names_both(r);
  return is_shown(r) && (!is_right_set(r) || (is_distinguishable(r) && !is_right_first(r)));
}

void write_miss(std::ostringstream& out, const json& r) {
  const std::string condition = condition_of(r);
  out << "| " << r.at("seed") << "/" << r.at("case") << (condition == "quantized" ? "" : " " + condition);
  std::string hidden, named;
  if (r.contains("hidden"))
    for (const json& kind : r.at("hidden")) hidden += (hidden.empty() ? "" : " + ") + kind.get<std::string>();
  out << " | " << (hidden.empty() ? first_hidden(r) : hidden);
  out << " | " << r.value("size", "") << " | ";
  if (r.contains("experiments"))
    out << r.at("experiments").size() << " " << r.at("campaign").get<std::string>() << " at "
        << number(r.at("rate_hz"), "%.0f") << " Hz";
  if (is_failed(r)) {
    out << " | failed: " << r.at("failed").get<std::string>() << " | | | | |\n";
    return;
  }
  for (const json& found : r.at("found")) {
    named += (named.empty() ? "" : ", ") + found.at("kind").get<std::string>();
    for (const json& other : found.at("confusable_with")) named += " (" + other.get<std::string>() + ")";
  }
  out << " | " << named << " | " << r.at("verdict").get<std::string>();
  for (const char* name : {"over_floor", "least_evidence", "worse_if_named"})
    out << " | " << (has_number(r, name) ? number(r.at(name)) : std::string());
  out << " |\n";
}

/// One line for each case that a figure counts as missed.
void write_misses(std::ostringstream& out, const Records& records) {
  out << "\n## Cases that were missed\n\n"
         "`diagnosis_matrix --seed S --case K` (with `--disturbed`, `--laboratory`, `--only`) reproduces "
         "each "
         "case.\n\n"
         "| seed/case | hidden | size | runs | named (confusable) | verdict | over floor | evidence | worse "
         "if named |\n"
         "|---|---|---|---|---|---|---|---|---|\n";
  for (const json& r : records)
    if (!is_timing(r) && is_missed(r)) write_miss(out, r);
}

using Binomial = boost::math::binomial_distribution<double>;
/// Of each bound: it fails to hold with this probability.
constexpr double bound_risk = 0.05;

}  // namespace

double share_upper_bound(double hits, double count) {
  return hits >= count ? 1.0 : Binomial::find_upper_bound_on_p(count, hits, bound_risk);
}

double share_lower_bound(double hits, double count) {
  return hits <= 0.0 ? 0.0 : Binomial::find_lower_bound_on_p(count, hits, bound_risk);
}

std::string tables_of(const Records& records) {
  std::ostringstream out;
  out << "# The diagnosis on hidden effects, as measured\n\n"
         "Written by `build/release/tests/bench/diagnosis_matrix` (the comment at its top says how cases are "
         "made,\n"
         "`tests/bench/diagnosis_judge.hpp` what \"visible\" and \"distinguishable\" mean, and "
         "`tests/blind/effect_sizes.hpp` how\n"
         "sizes are set). "
      << records.size() << " cases, seeds";
  std::set<std::string> seeds;
  for (const json& r : records) seeds.insert(r.at("seed").dump());
  for (const std::string& seed : seeds) out << " " << seed;
  out << ". Bounds of shares are one-sided at 95 % (Clopper and Pearson).\n"
         "A case that failed or took too long counts as missed; one without a hidden effect then only under "
         "\"completed\". Timing cases are six 10 s runs at 500 Hz, of a laboratory seven at 1 kHz.\n\n";
  write_figures(out, records);
  write_counts(out, records);
  write_spreads(out, records);
  for (const Goals& goals : all_goals) write_confusion(out, records, goals);
  write_misses(out, records);
  return out.str();
}

}  // namespace upright::blind
