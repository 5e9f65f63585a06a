// How often the check of measured data names a mistake that was made, and how often one that was not: on
// blind cases, whose rigs have hidden effects of every kind.
//
//   data_check_rates CASES [SEED [MISTAKE [laboratory]]]
//
// MISTAKE is a part of the name of those that are made: "none", for example. With `laboratory`, the rigs, the
// disturbances and the records are those of laboratories, else they are those of an IP02. Prints a Markdown
// table for docs/results/data-check.md.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "blind_case.hpp"
#include "measurement/data_check.hpp"
#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"

namespace {

using namespace upright;
using namespace upright::blind;
namespace fs = std::filesystem;

constexpr double degree = std::numbers::pi / 180.0;

/// A record as a file holds it.
struct Table {
  std::vector<double> t, u, x, th;
  bool cart_locked = false;
};

/// Values as they were `later_s` before.
std::vector<double> late(const Table& table, const std::vector<double>& values, double later_s) {
  std::vector<double> result;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto at = std::upper_bound(table.t.begin(), table.t.end(), table.t[k] - later_s + 1e-9);
    result.push_back(values[at == table.t.begin() ? 0 : static_cast<std::size_t>(at - table.t.begin()) - 1]);
  }
  return result;
}

/// An angle folded into [from, from + width].
void fold(std::vector<double>& angle, double from, double width) {
  for (double& a : angle) a -= width * std::floor((a - from) / width);
}

bool jumps(const std::vector<double>& angle) {
  for (std::size_t k = 1; k < angle.size(); ++k)
    if (std::abs(angle[k] - angle[k - 1]) > 1.0) return true;
  return false;
}

void scale(std::vector<double>& values, double factor) {
  for (double& v : values) v *= factor;
}

void jitter(Table& table, double share) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const double period_s = (table.t.back() - table.t.front()) / static_cast<double>(table.t.size() - 1);
  double last = -1e9;
  for (double& t : table.t) last = t = std::max(t + share * period_s * normal(random), last + 1e-6);
}

struct Mistake {
  const char* name;
  const char* said;
  std::function<bool(Table&)> make;  ///< false: not possible with these data
};

bool driven(const Table& t) {
  return !t.x.empty() && !t.u.empty() && !t.cart_locked;
}

/// In whole numbers, as an encoder counts.
void count(std::vector<double>& values, double per_unit) {
  for (double& v : values) v = std::round(v * per_unit);
}

const std::vector<Mistake>& mistakes() {
  using std::numbers::pi;
  const auto both = [](const Table& t) { return driven(t) && !t.th.empty(); };
  static const std::vector<Mistake> list = {
      {"none", "", [](Table&) { return true; }},
      {"voltage sign", "voltage_v has the wrong sign", [](Table& t) { return scale(t.u, -1.0), driven(t); }},
      {"cart sign", "cart_m has the wrong sign", [both](Table& t) { return scale(t.x, -1.0), both(t); }},
      {"angle sign", "theta_rad has the wrong sign", [both](Table& t) { return scale(t.th, -1.0), both(t); }},
      {"angle zero hanging", "theta_rad is zero where the pendulum hangs",
       [](Table& t) {
         for (double& a : t.th) a -= pi;
         return !t.th.empty();
       }},
      {"angle in degrees", "theta_rad is in degrees",
       [](Table& t) { return scale(t.th, 1.0 / degree), !t.th.empty(); }},
      {"degrees in -180..180", "theta_rad is in degrees",
       [](Table& t) {
         scale(t.th, 1.0 / degree);
         fold(t.th, -180.0, 360.0);
         return !t.th.empty();
       }},
      {"degrees in 0..360", "theta_rad is in degrees",
       [](Table& t) {
         scale(t.th, 1.0 / degree);
         fold(t.th, 0.0, 360.0);
         return !t.th.empty();
       }},
      {"angle in counts", "theta_rad is in counts",
       [](Table& t) { return count(t.th, 4096.0 / (2.0 * pi)), !t.th.empty(); }},
      {"cart in mm", "cart_m is in millimetres", [](Table& t) { return scale(t.x, 1e3), driven(t); }},
      {"cart in cm", "cart_m is in centimetres", [](Table& t) { return scale(t.x, 1e2), driven(t); }},
      {"cart in counts", "cart_m is in counts",
       [](Table& t) { return count(t.x, 1.0 / 2.27485e-5), driven(t); }},
      {"voltage in mV", "voltage_v is in millivolts", [](Table& t) { return scale(t.u, 1e3), driven(t); }},
      {"time in ms", "time_s is in milliseconds", [](Table& t) { return scale(t.t, 1e3), true; }},
      {"cart and angle swapped", "cart_m and theta_rad are swapped",
       [both](Table& t) { return std::swap(t.x, t.th), both(t); }},
      {"voltage and cart swapped", "voltage_v and cart_m are swapped",
       [](Table& t) { return std::swap(t.x, t.u), driven(t); }},
      {"voltage and angle swapped", "voltage_v and theta_rad are swapped",
       [both](Table& t) { return std::swap(t.u, t.th), both(t); }},
      {"angle 20 ms late", "later than", [both](Table& t) { return t.th = late(t, t.th, 0.02), both(t); }},
      {"angle 50 ms late", "later than", [both](Table& t) { return t.th = late(t, t.th, 0.05), both(t); }},
      {"cart 20 ms late", "later than", [both](Table& t) { return t.x = late(t, t.x, 0.02), both(t); }},
      {"voltage 20 ms late", "later than", [](Table& t) { return t.u = late(t, t.u, 0.02), driven(t); }},
      {"voltage 50 ms late", "later than", [](Table& t) { return t.u = late(t, t.u, 0.05), driven(t); }},
      {"angle folded at half turns", "folded",
       [](Table& t) {
         fold(t.th, -pi / 2.0, pi);
         return jumps(t.th);
       }},
      {"angle folded into 0..90 degrees", "folded",
       [](Table& t) {
         fold(t.th, 0.0, pi / 2.0);
         return jumps(t.th);
       }},
      {"sign of the angle lost", "mirrored",
       [](Table& t) {
         bool passes = false;
         for (double& a : t.th) {
           a -= pi * 2.0 * std::round(a / (2.0 * pi));
           passes = passes || (a < 0.0) != (t.th.front() < 0.0);
           a = std::abs(a);
         }
         return passes;
       }},
      {"stamps scatter by 10 % of the period", "scatter", [](Table& t) { return jitter(t, 0.1), true; }},
      {"stamps scatter by 30 % of the period", "scatter", [](Table& t) { return jitter(t, 0.3), true; }},
  };
  return list;
}

fs::path write(const Table& table, const fs::path& folder, const std::string& name) {
  std::ofstream out(folder / (name + ".csv"));
  out << "time_s,voltage_v" << (table.x.empty() ? "" : ",cart_m") << (table.th.empty() ? "" : ",theta_rad")
      << "\n";
  for (std::size_t k = 0; k < table.t.size(); ++k) {
    out << exact_text(table.t[k]) << ',' << exact_text(table.u[k]);
    if (!table.x.empty()) out << ',' << exact_text(table.x[k]);
    if (!table.th.empty()) out << ',' << exact_text(table.th[k]);
    out << '\n';
  }
  if (!table.cart_locked) return folder / (name + ".csv");
  std::ofstream(folder / (name + ".yaml")) << "dataset:\n  file: " << name
                                           << ".csv\n  columns: {time_s: time_s, theta_rad: theta_rad, "
                                              "voltage_v: voltage_v}\n  cart_locked: true\n";
  return folder / (name + ".yaml");
}

/// Every effect of the registry, none, pairs, and what the registry lacks, in turn.
Case case_of(std::uint64_t seed, std::size_t number, bool laboratory) {
  std::vector<std::vector<std::string>> hidden = {{}, {}, {}};
  for (const EffectInfo& info : effect_registry()) hidden.push_back({std::string(info.kind)});
  for (const std::string& kind : unknown_kinds(laboratory ? Condition::laboratory : Condition::quantized))
    hidden.push_back({kind});
  Request request;
  request.seed = seed_of_case(seed, number);
  for (int i = 0; i < 4; ++i) hidden.push_back(random_pair(request.seed + static_cast<std::uint64_t>(i)));
  request.hidden = hidden[number % hidden.size()];
  request.size = static_cast<Size>((number + number / hidden.size()) % 3);
  request.condition = laboratory        ? Condition::laboratory
                      : number % 4 == 3 ? Condition::disturbed
                                        : Condition::quantized;
  request.runs = laboratory ? 0 : 2;
  return make_case(request);
}

struct Tally {
  int made = 0, said = 0, other = 0, unreadable = 0;
};

void count_case(const Case& blind, const fs::path& folder, std::vector<Tally>& tallies, const char* only) {
  for (const Measurement& run : measure_all(blind)) {
    for (std::size_t i = 0; i < mistakes().size(); ++i) {
      const Mistake& mistake = mistakes()[i];
      if (only != nullptr && std::string(mistake.name).find(only) == std::string::npos) continue;
      Table table{run.time_s, run.voltage_v, run.cart_m, run.theta_rad, run.cart_locked};
      if (!mistake.make(table)) continue;
      ++tallies[i].made;
      std::string said;
      try {
        const auto found = find_mistakes({read_measurement(write(table, folder, run.name))}, blind.believed);
        if (!found.empty()) {
          said = found[0].cause;
          for (const std::string& other : found[0].or_else) said += " | " + other;
        }
      } catch (const Error& error) {
        ++tallies[i].unreadable;
        continue;
      }
      const bool named = *mistake.said != '\0' && said.find(mistake.said) != std::string::npos;
      if (named)
        ++tallies[i].said;
      else if (!said.empty())
        ++tallies[i].other;
      if (!said.empty() && !named)
        std::fprintf(stderr, "seed %llu %s, hidden: %s, %s: %s\n",
                     static_cast<unsigned long long>(blind.request.seed), run.name.c_str(),
                     blind.request.hidden.empty() ? "nothing" : blind.request.hidden[0].c_str(), mistake.name,
                     said.c_str());
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::size_t cases = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 20;
  const std::uint64_t seed = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 1;
  const bool laboratory = argc > 4 && std::string(argv[4]) == "laboratory";
  const fs::path folder = fs::temp_directory_path() / "upright_data_check_rates";
  fs::create_directories(folder);
  std::vector<Tally> tallies(mistakes().size());
  for (std::size_t number = 0; number < cases; ++number) {
    try {
      count_case(case_of(seed, number, laboratory), folder, tallies, argc > 3 ? argv[3] : nullptr);
    } catch (const Error& error) {
      std::fprintf(stderr, "case %zu: %s\n", number, error.what());
    }
  }
  std::printf(
      "| mistake | records | named | another named | refused by the reader |\n|---|---|---|---|---|\n");
  for (std::size_t i = 0; i < tallies.size(); ++i)
    std::printf("| %s | %d | %d | %d | %d |\n", mistakes()[i].name, tallies[i].made, tallies[i].said,
                tallies[i].other, tallies[i].unreadable);
}
