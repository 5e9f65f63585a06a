#include "diagnosis_tables.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>
#include <set>
#include <sstream>

#include "upright/model/registry.hpp"

namespace upright::blind {

namespace {

using nlohmann::json;
using Records = std::vector<json>;

/// Structures that fit worse than the true one by less than this are not told apart.
constexpr double distinguishable = 16.0;

bool is_failed(const json& r) {
  return r.contains("failed");
}

/// Six runs of ten seconds at 500 Hz, for the time they take; not counted otherwise.
bool is_timing(const json& r) {
  return r.value("timing", false);
}

std::string first_hidden(const json& r) {
  return r.at("hidden").empty() ? "none" : r.at("hidden")[0].get<std::string>();
}

bool is_unknown(const json& r) {
  return effect_number(first_hidden(r)) == effect_count && first_hidden(r) != "none";
}

bool is_pair(const json& r) {
  return r.at("hidden").size() == 2;
}

bool is_single(const json& r) {
  return r.at("hidden").size() == 1 && !is_unknown(r);
}

bool is_shown(const json& r) {
  return r.value("shown", true);
}

std::string first_named(const json& r) {
  return r.at("found").empty() ? "none" : r.at("found")[0].at("kind").get<std::string>();
}

bool contains(const json& list, const std::string& text) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

bool is_same_force(const json& r) {
  return r.contains("same_force") && !r.at("same_force").empty();
}

/// By the data: whether the hidden effect differs from the one that was named.
bool is_distinguishable(const json& r) {
  if (is_same_force(r)) return false;
  return !r.contains("worse_if_named") || r.at("worse_if_named").is_null() ||
         r.at("worse_if_named").get<double>() > distinguishable;
}

bool is_right_first(const json& r) {
  return first_named(r) == first_hidden(r);
}

bool is_in_declared_set(const json& r, const std::string& hidden) {
  for (const json& found : r.at("found"))
    if (found.at("kind") == hidden || contains(found.at("confusable_with"), hidden)) return true;
  return false;
}

/// The hidden effect is the first one named or declared not to be told from it.
bool is_right_set(const json& r) {
  return is_right_first(r) ||
         (!r.at("found").empty() && contains(r.at("found")[0].at("confusable_with"), first_hidden(r)));
}

/// A base parameter, or the number of an effect that the plant file has: both are a few percent off in every
/// case.
bool is_correction(const json& r, const json& found) {
  return found.at("enters") == "parameter" || contains(r.at("known_effects"), found.at("kind"));
}

bool names_a_structure(const json& r) {
  return std::any_of(r.at("found").begin(), r.at("found").end(),
                     [&](const json& found) { return !is_correction(r, found); });
}

bool names_both(const json& r) {
  return std::all_of(r.at("hidden").begin(), r.at("hidden").end(),
                     [&](const json& kind) { return is_in_declared_set(r, kind.get<std::string>()); });
}

struct Estimate {
  double error;  ///< relative
  bool covered;
};

/// Errors of the parameters of hidden effects that were named. A phase counts as a share of half a turn; the
/// centre of a spring has no size of its own and is left out.
std::vector<Estimate> estimates_of(const json& r) {
  std::vector<Estimate> estimates;
  for (const json& found : r.at("found")) {
    const std::string kind = found.at("kind");
    if (!r.at("truth").contains(kind)) continue;
    for (const auto& [name, p] : found.at("parameters").items()) {
      if (name == "center_m") continue;
      const double truth = r.at("truth").at(kind).at(name), value = p.at("value");
      double off = value - truth, size = std::abs(truth);
      if (name == "phase_rad") {
        off = std::remainder(off, 2.0 * std::numbers::pi);
        size = std::numbers::pi;
      }
      const double low = p.at("low"), high = p.at("high");
      estimates.push_back({std::abs(off) / size, value - off >= low && value - off <= high});
    }
  }
  return estimates;
}

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
};

Share share_of(const Records& records, const std::function<bool(const json&)>& counts,
               const std::function<bool(const json&)>& hits) {
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

Figure share_figure(const std::string& name, const Share& share, double goal, bool at_least = true) {
  Figure figure{name, (at_least ? ">= " : "<= ") + number(100.0 * goal) + " %", share.text()};
  figure.known = share.count > 0.0;
  figure.holds = at_least ? share.value() >= goal : share.value() <= goal;
  return figure;
}

Figure level_figure(const std::string& name, double value, double goal, const std::string& unit,
                    double scale) {
  Figure figure{name, "<= " + number(goal * scale) + unit, number(value * scale) + unit};
  figure.known = !std::isnan(value);
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

std::vector<Figure> figures_of(const Records& records, bool disturbed) {
  const auto single = [](const json& r) { return is_single(r) && is_shown(r); };
  const auto clear = [&](const json& r) { return single(r) && is_distinguishable(r); };
  std::vector<double> errors, over_floor;
  Share covered, floor_kept;
  for (const json& r : records) {
    if (is_unknown(r) || !is_shown(r)) continue;
    if (r.contains("over_floor") && r.at("over_floor").is_number()) {
      over_floor.push_back(r.at("over_floor"));
      floor_kept.count += 1.0;
      floor_kept.hits += over_floor.back() <= (disturbed ? 1.10 : 1.05) ? 1.0 : 0.0;
    }
    if (!is_single(r) || !is_right_first(r)) continue;
    for (const Estimate& e : estimates_of(r)) {
      errors.push_back(e.error);
      covered.count += 1.0;
      covered.hits += e.covered ? 1.0 : 0.0;
    }
  }
  const auto all_of = [](const json&) { return true; };
  return {
      share_figure("right effect named first (visible and distinguishable effects)",
                   share_of(records, clear, is_right_first), disturbed ? 0.90 : 0.98),
      share_figure("right set, including effects declared as confusable",
                   share_of(records, single, is_right_set), disturbed ? 0.98 : 1.0),
      share_figure("false effect in cases without a hidden effect",
                   share_of(
                       records, [](const json& r) { return first_hidden(r) == "none"; }, names_a_structure),
                   disturbed ? 0.03 : 0.01, false),
      share_figure("unknown effect reported as unexplained",
                   share_of(
                       records, [](const json& r) { return is_unknown(r) && is_shown(r); },
                       [](const json& r) { return r.at("verdict") == "unexplained"; }),
                   disturbed ? 0.90 : 0.95),
      level_figure("parameter error, median", quantile(errors, 0.5), disturbed ? 0.05 : 0.01, " %", 100.0),
      level_figure("parameter error, 90th percentile", quantile(errors, 0.9), disturbed ? 0.15 : 0.05, " %",
                   100.0),
      coverage_figure(covered, disturbed ? 0.90 : 0.92, 0.98),
      level_figure("held-out error relative to the true model's floor, median", quantile(over_floor, 0.5),
                   disturbed ? 1.10 : 1.05, "", 1.0),
      share_figure("held-out error within the limit above", floor_kept, 0.95),
      share_figure("both of two hidden effects found",
                   share_of(
                       records, [](const json& r) { return is_pair(r) && is_shown(r); }, names_both),
                   disturbed ? 0.80 : 0.90),
      share_figure("completed without a failure",
                   share_of(records, all_of, [](const json& r) { return !is_failed(r); }), 1.0),
  };
}

Records usable(const Records& records, bool disturbed) {
  Records chosen;
  for (const json& r : records)
    if (r.at("disturbed").get<bool>() == disturbed && !is_failed(r) && !is_timing(r)) chosen.push_back(r);
  return chosen;
}

void write_figures(std::ostringstream& out, const Records& records) {
  std::vector<std::vector<Figure>> columns;
  for (const bool disturbed : {false, true}) {
    columns.push_back(figures_of(usable(records, disturbed), disturbed));
    // Failures have no fields: count them apart.
    Share ended;
    for (const json& r : records) {
      if (r.at("disturbed").get<bool>() != disturbed || is_timing(r)) continue;
      ended.count += 1.0;
      ended.hits += is_failed(r) ? 0.0 : 1.0;
    }
    columns.back().back() = share_figure("completed without a failure", ended, 1.0);
    std::vector<double> wall;
    for (const json& r : records)
      if (r.at("disturbed").get<bool>() == disturbed && is_timing(r) && !is_failed(r))
        wall.push_back(r.at("wall_s"));
    columns.back().push_back(
        level_figure("time for six 10 s runs at 500 Hz, median", quantile(wall, 0.5), 20.0, " s", 1.0));
  }
  out << "| figure | must be | quantization only | | must be | disturbed | "
         "|\n|---|---|---|---|---|---|---|\n";
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

void write_counts(std::ostringstream& out, const Records& records) {
  out << "\n| other counts | quantization only | disturbed |\n|---|---|---|\n";
  const auto row = [&](const std::string& name, const std::function<bool(const json&)>& counts,
                       const std::function<bool(const json&)>& hits) {
    out << "| " << name;
    for (const bool disturbed : {false, true})
      out << " | " << share_of(usable(records, disturbed), counts, hits).text();
    out << " |\n";
  };
  const auto shown_single = [](const json& r) { return is_single(r) && is_shown(r); };
  row("hidden effects that are visible in the data", is_single, is_shown);
  row("of these, with the same force as another effect", shown_single, is_same_force);
  row("of these, not distinguishable from the named effect", shown_single,
      [](const json& r) { return !is_same_force(r) && !is_distinguishable(r); });
  row(
      "effects with the same force as another: declared as confusable",
      [&](const json& r) { return shown_single(r) && is_same_force(r); },
      [](const json& r) { return is_right_set(r); });
  row(
      "invisible effects: a structural effect named",
      [](const json& r) { return is_single(r) && !is_shown(r); }, names_a_structure);
  row(
      "a structural effect in addition to the right one",
      [&](const json& r) { return shown_single(r) && is_right_first(r); },
      [](const json& r) {
        std::size_t structural = 0;
        for (const json& found : r.at("found")) structural += is_correction(r, found) ? 0u : 1u;
        return structural > 1;
      });
  row(
      "verdict explained or no_discrepancy (known or no hidden effect)",
      [](const json& r) { return !is_unknown(r); },
      [](const json& r) { return r.at("verdict") != "unexplained"; });
  row("pairs that are visible in the data", is_pair, is_shown);
  for (const char* size : {"weak", "typical", "strong"})
    row(
        std::string("right effect named first, ") + size,
        [=](const json& r) {
          return is_single(r) && is_shown(r) && is_distinguishable(r) && r.at("size") == size;
        },
        is_right_first);
  for (const char* campaign : {"mixed", "hanging", "upright", "cart_alone", "locked"})
    row(
        std::string("right effect named first, ") + campaign,
        [=](const json& r) {
          return is_single(r) && is_shown(r) && is_distinguishable(r) && r.at("campaign") == campaign;
        },
        is_right_first);
  for (const bool disturbed : {false, true}) {
    std::vector<double> cpu, gap;
    for (const json& r : usable(records, disturbed)) cpu.push_back(r.at("cpu_s"));
    out << (disturbed ? ""
                      : "\nCPU seconds of a diagnosis (cases of at most 12000 samples), median and largest:");
    out << (disturbed ? "; disturbed " : " quantization only ") << number(quantile(cpu, 0.5)) << " and "
        << number(quantile(cpu, 1.0)) << (disturbed ? ".\n" : "");
  }
  std::vector<double> cpu;
  for (const json& r : records)
    if (is_timing(r) && !is_failed(r)) cpu.push_back(r.at("cpu_s"));
  if (!cpu.empty())
    out << "\nOf six 10 s runs at 500 Hz: median " << number(quantile(cpu, 0.5)) << ", largest "
        << number(quantile(cpu, 1.0)) << " CPU seconds in " << cpu.size() << " cases.\n";
}

void write_confusion(std::ostringstream& out, const Records& records, bool disturbed) {
  std::map<std::string, std::map<std::string, int>> counts;
  for (const json& r : usable(records, disturbed)) {
    if (is_pair(r) || !is_shown(r)) continue;
    const std::string named = is_unknown(r) && r.at("verdict") == "unexplained"    ? "(unexplained)"
                              : first_hidden(r) == "none" && !names_a_structure(r) ? "none"
                                                                                   : first_named(r);
    counts[first_hidden(r)][named] += 1;
  }
  if (counts.empty()) return;
  out << "\n## Hidden and first-named effects, " << (disturbed ? "disturbed" : "quantization only")
      << "\n\nSingle visible effects: for each hidden effect, how often which effect was named "
         "first.\n\n"
         "| hidden | right | named instead |\n|---|---|---|\n";
  for (const auto& [hidden, named] : counts) {
    int total = 0, right = 0;
    std::string others;
    for (const auto& [name, count] : named) {
      total += count;
      if (name == hidden || name == "(unexplained)") {
        right += count;
      } else {
        others += (others.empty() ? "" : ", ") + name + " " + std::to_string(count);
      }
    }
    out << "| " << hidden << " | " << right << " of " << total << " | " << others << " |\n";
  }
}

/// One line for each case that a figure counts as missed.
void write_misses(std::ostringstream& out, const Records& records) {
  out << "\n## Cases that were missed\n\n"
         "`diagnosis_matrix --seed S --case K` (with `--disturbed`, `--only`) reproduces each case.\n\n"
         "| seed/case | hidden | size | runs | named (confusable) | verdict | over floor | evidence | worse "
         "if named |\n"
         "|---|---|---|---|---|---|---|---|---|\n";
  for (const json& r : records) {
    if (is_timing(r)) continue;
    const std::string key =
        r.at("seed").dump() + "/" + r.at("case").dump() + (r.at("disturbed") ? " disturbed" : "");
    if (is_failed(r)) {
      out << "| " << key << " | " << r.at("label").get<std::string>()
          << " | | | failed: " << r.at("failed").get<std::string>() << " | | | | |\n";
      continue;
    }
    bool missed = false;
    if (is_unknown(r)) {
      missed = is_shown(r) && r.at("verdict") != "unexplained";
    } else if (first_hidden(r) == "none") {
      missed = names_a_structure(r) || r.at("verdict") == "unexplained";
    } else if (is_pair(r)) {
      missed = is_shown(r) && !names_both(r);
    } else {
      missed = is_shown(r) && (!is_right_set(r) || (is_distinguishable(r) && !is_right_first(r)));
    }
    if (!missed) continue;
    std::string hidden, named;
    for (const json& kind : r.at("hidden")) hidden += (hidden.empty() ? "" : " + ") + kind.get<std::string>();
    for (const json& found : r.at("found")) {
      named += (named.empty() ? "" : ", ") + found.at("kind").get<std::string>();
      for (const json& other : found.at("confusable_with")) named += " (" + other.get<std::string>() + ")";
    }
    const auto value = [&](const char* name) {
      return r.contains(name) && r.at(name).is_number() ? number(r.at(name)) : std::string();
    };
    out << "| " << key << " | " << hidden << " | " << r.at("size").get<std::string>() << " | "
        << r.at("experiments").size() << " " << r.at("campaign").get<std::string>() << " at "
        << number(r.at("rate_hz"), "%.0f") << " Hz | " << named << " | " << r.at("verdict").get<std::string>()
        << " | " << value("over_floor") << " | " << value("least_evidence") << " | "
        << value("worse_if_named") << " |\n";
  }
}

}  // namespace

std::vector<json> read_records(const std::string& file) {
  std::vector<json> records;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    json record = json::parse(line, nullptr, false);
    if (!record.is_discarded()) records.push_back(std::move(record));
  }
  return records;
}

std::string tables_of(const std::vector<json>& records) {
  std::ostringstream out;
  out << "# The diagnosis on hidden effects, as measured\n\n"
         "Written by `build/release/tests/bench/diagnosis_matrix` (the comment at its top says how cases are "
         "made and what\n"
         "\"visible\" and \"distinguishable\" mean; `tests/blind/blind_case.hpp` says how sizes are set). "
      << records.size() << " cases, seeds";
  std::set<std::string> seeds;
  for (const json& r : records) seeds.insert(r.at("seed").dump());
  for (const std::string& seed : seeds) out << " " << seed;
  out << ".\n\n";
  write_figures(out, records);
  write_counts(out, records);
  write_confusion(out, records, false);
  write_confusion(out, records, true);
  write_misses(out, records);
  return out.str();
}

}  // namespace upright::blind
