// The matrix: how often the diagnosis names the effect that is hidden in data from a rig that is not its
// model.
//
//   diagnosis_matrix --cases N --out FILE.jsonl [--seed N] [--disturbed] [--only KIND] [--size
//   weak|typical|strong]
//                    [--runs N] [--jobs J] [--markdown FILE.md] [--keep DIR] [--case K]
//
// Cases are numbered from 0 and follow from the seed and the number. Each runs in a process of its own and
// appends one line to FILE.jsonl; what is there already is not run again, so that a matrix can be stopped and
// continued.
// --markdown writes the tables of everything that is in FILE.jsonl (and, with it alone, runs nothing).
// --timing makes every case six runs of ten seconds at 500 Hz; with --jobs 1 their wall time is the figure of
// the table.
// --case K with --keep DIR writes the plant file, the runs and the truth of one case, for `upright diagnose`.
//
// The diagnosis works as the command does: the runs are written as CSV and read again, and it sees nothing
// else. What the data can show at all is measured here, apart from it, with fits that begin at the truth:
// - visible: the true structure saves at least 25 of minus twice the log likelihood on all runs, compared
// with
//   the plant file with its own numbers refitted. Of effects that the registry lacks: the runs are at least
//   20 percent further off (plain simulation) than the same runs without it.
// - distinguishable: the effect is not the same force as the one named (docs/reference/effects.md), and the
//   structure that was named instead fits worse than the true one by 16 or more.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "blind_case.hpp"
#include "diagnosis/candidates.hpp"
#include "diagnosis_tables.hpp"
#include "upright/base/error.hpp"
#include "upright/diagnosis/diagnosis.hpp"
#include "upright/model/plant_file.hpp"

namespace {

using namespace upright;
using namespace upright::blind;
using nlohmann::json;
namespace fs = std::filesystem;

constexpr double shown_evidence = 25.0;
constexpr double shown_ratio = 1.2;

struct Flags {
  std::uint64_t seed = 1;
  std::size_t cases = 0;
  std::optional<std::size_t> one_case;
  std::string only, out, markdown, keep;
  std::optional<Size> size;
  bool disturbed = false;
  int runs = 0, jobs = 1;
  double most_samples = 12000.0;
  bool timing = false;
  double most_seconds = 900.0;
};

/// One round: every effect of the registry once, six rigs with nothing hidden, eight pairs, each unknown
/// twice.
std::vector<std::string> round_of_labels() {
  std::vector<std::string> labels;
  for (const EffectInfo& info : effect_registry()) labels.emplace_back(info.kind);
  for (int i = 0; i < 6; ++i) labels.emplace_back("none");
  for (int i = 0; i < 8; ++i) labels.emplace_back("pair");
  for (int i = 0; i < 2; ++i)
    for (const std::string& kind : unknown_kinds()) labels.push_back(kind);
  // Spread over the round, so that the first cases are as varied as all.
  std::vector<std::string> spread;
  constexpr std::size_t stride = 13;
  for (std::size_t first = 0; first < stride; ++first)
    for (std::size_t i = first; i < labels.size(); i += stride) spread.push_back(labels[i]);
  return spread;
}

Request request_of(const Flags& flags, std::size_t number, std::string& label) {
  static const std::vector<std::string> labels = round_of_labels();
  const std::size_t round = number / labels.size();
  label = flags.only.empty() ? labels[number % labels.size()] : flags.only;
  Request request;
  request.seed = flags.seed * 1000003 + number;
  request.size = flags.size.value_or(static_cast<Size>((number + round) % 3));
  request.disturbed = flags.disturbed;
  request.runs = flags.runs;
  request.most_samples = flags.most_samples;
  if (flags.timing) {
    request.runs = 6;
    request.rate_hz = 500.0;
    request.duration_s = 10.0;
    request.most_samples = 30000.0;
  }
  if (label == "pair") {
    request.hidden = random_pair(request.seed);
    request.size = request.size == Size::weak ? Size::typical : request.size;
  } else if (label != "none") {
    request.hidden = {label};
  }
  return request;
}

/// Writes runs as files and reads them back, as the command does.
std::vector<Measurement> through_files(const std::vector<Measurement>& runs, const fs::path& folder) {
  fs::create_directories(folder);
  std::vector<fs::path> written;
  for (const Measurement& run : runs) {
    const fs::path file = folder / (run.name + ".csv");
    std::ofstream out(file);
    out << "time_s,voltage_v" << (run.has_cart() ? ",cart_m" : "") << (run.has_theta() ? ",theta_rad" : "")
        << "\n";
    for (std::size_t k = 0; k < run.size(); ++k) {
      out << exact_text(run.time_s[k]) << ',' << exact_text(run.voltage_v[k]);
      if (run.has_cart()) out << ',' << exact_text(run.cart_m[k]);
      if (run.has_theta()) out << ',' << exact_text(run.theta_rad[k]);
      out << '\n';
    }
    out.close();
    if (!run.cart_locked) {
      written.push_back(file);
      continue;
    }
    const fs::path dataset = folder / (run.name + ".yaml");
    std::ofstream(dataset)
        << "dataset:\n  file: " << run.name
        << ".csv\n  columns: {time_s: time_s, theta_rad: theta_rad, voltage_v: voltage_v}\n"
           "  cart_locked: true\n";
    written.push_back(dataset);
  }
  return read_measurements(written);
}

/// How much larger a base parameter of `start` is than the believed one, as the effect that corrects it says
/// it.
double base_scale(const Plant& believed, const Plant& start, const std::string& kind) {
  if (kind == "cart_mass") return start.cart_mass_kg / believed.cart_mass_kg;
  if (kind == "back_emf" && believed.motor.back_emf_n_per_mps > 0.0)
    return start.motor.back_emf_n_per_mps / believed.motor.back_emf_n_per_mps;
  if (kind == "pendulum_mass" && believed.pendulum)
    return start.pendulum->mass_kg / believed.pendulum->mass_kg;
  if (kind == "pendulum_length" && believed.pendulum)
    return start.pendulum->length_to_com_m / believed.pendulum->length_to_com_m;
  return effect_registry()[effect_number(kind)].parameters[0].neutral;
}

/// From what the sensors show to what is.
void unscale(const Plant& plant, PlantState<double>& state) {
  const auto value = [&](const char* kind, double neutral) {
    const PlantEffect* effect = plant.find(kind);
    return effect != nullptr ? effect->values[0] : neutral;
  };
  const double cart = value("cart_scale", 1.0), angle = value("angle_scale", 1.0);
  state.cart_m /= cart;
  state.cart_mps /= cart;
  state.theta_rad = (state.theta_rad - value("angle_offset", 0.0)) / angle;
  state.theta_radps /= angle;
}

/// A structure fitted to all runs, from the numbers of `start`: everything the plant file has within what is
/// believed of it, these effects free.
FitResult fit_structure(const std::vector<Measurement>& runs, const Plant& believed, const Plant& start,
                        const std::vector<std::size_t>& effects, const Noise& noise) {
  const SelectionPolicy policy;
  const DataRange range = range_of(runs, believed, policy.excitation);
  FitData data{&runs, cut_segments(runs)};
  FitPoint point{believed, {}, noise};
  std::vector<FreeParameter> free;
  const auto include = [&](const std::vector<FreeParameter>& more) {
    free.insert(free.end(), more.begin(), more.end());
  };
  const auto added = [&](std::size_t effect) {
    return std::find(effects.begin(), effects.end(), effect) != effects.end();
  };
  for (const PlantEffect& effect : believed.effects) {
    if (added(effect.number)) continue;
    if (const PlantEffect* from = start.find(effect.number)) point.plant.set(effect.number, from->values);
    include(correction_parameters(believed, effect.number, range, policy.prior));
  }
  for (const std::size_t effect : base_corrections(believed, range)) {
    point.plant.set(effect, std::vector<double>{base_scale(believed, start, kind_of(effect))});
    if (!added(effect)) include(correction_parameters(believed, effect, range, policy.prior));
  }
  for (const std::size_t effect : effects) {
    if (const PlantEffect* from = start.find(effect)) point.plant.set(effect, from->values);
    include(free_parameters(effect, range, policy.prior));
  }
  point.starts = estimate_initial_states(runs, data.segments, point.plant);
  for (PlantState<double>& state : point.starts) unscale(point.plant, state);
  // To convergence: a fit that stops early would pass for a structure that fits worse.
  FitOptions options;
  options.max_iterations = 40;
  options.noise_rounds = 8;
  options.tolerance = 1e-6;
  FitResult best = fit(data, point, free, options);
  // A wrong start and much noise can hold each other up; from little noise the way is another.
  point = best.point;
  point.noise.force *= 0.1;
  point.noise.torque *= 0.1;
  const FitResult again = fit(data, point, free, options);
  return again.objective < best.objective ? again : best;
}

/// Root mean square of a plain simulation of these runs, in units of the sensors' noise.
double plain_rms(const std::vector<Measurement>& runs, const Plant& plant,
                 const std::vector<std::size_t>& which) {
  FitData data{&runs, {}};
  for (const Segment& segment : cut_segments(runs))
    if (std::find(which.begin(), which.end(), segment.run) != which.end()) data.segments.push_back(segment);
  if (data.segments.empty()) return 0.0;
  return whitened_rms(
      fit_initial_states(data, {plant, estimate_initial_states(runs, data.segments, plant), {}}));
}

std::vector<std::size_t> all_runs(const std::vector<Measurement>& runs) {
  std::vector<std::size_t> which;
  for (std::size_t r = 0; r < runs.size(); ++r) which.push_back(r);
  return which;
}

/// Effects that are exactly the same force as this one in the true plant (docs/reference/effects.md).
std::vector<std::string> same_force(const std::string& kind, const Plant& truth) {
  if (kind == "viscous_friction") return {"back_emf"};
  if (kind == "back_emf") return {"viscous_friction"};
  if (kind == "constant_force") return {"voltage_offset", "friction_asymmetry"};
  if (kind == "voltage_offset") return {"constant_force", "friction_asymmetry"};
  if (kind == "friction_asymmetry") {
    const PlantEffect* coulomb = truth.find("coulomb_friction");
    const double d = truth.find(kind)->values[0];
    if (coulomb != nullptr && coulomb->values[0] > std::abs(d)) return {"constant_force", "voltage_offset"};
  }
  return {};
}

json values_json(std::size_t effect, const std::vector<double>& values) {
  json result = json::object();
  const EffectInfo& info = effect_registry()[effect];
  for (std::size_t i = 0; i < info.parameters.size(); ++i)
    result[std::string(info.parameters[i].name)] = values[i];
  return result;
}

void describe_diagnosis(const Diagnosis& d, json& record) {
  record["verdict"] = std::string(name_of(d.verdict));
  record["gap_before"] = d.gap_before;
  record["gap_after"] = d.gap_after;
  record["residual"] = d.residual;
  record["found"] = json::array();
  for (const FoundEffect& effect : d.effects) {
    json found = {{"kind", kind_of(effect.effect)},
                  {"enters", std::string(name_of(effect_registry()[effect.effect].enters))},
                  {"gap_after", effect.gap_after},
                  {"confusable_with", json::array()},
                  {"parameters", json::object()}};
    for (const std::size_t other : effect.indistinguishable_from)
      found["confusable_with"].push_back(kind_of(other));
    for (const ParameterEstimate& p : effect.parameters)
      found["parameters"][p.name] = {{"value", p.value}, {"low", p.low}, {"high", p.high}};
    record["found"].push_back(found);
  }
  record["candidates"] = json::array();
  for (std::size_t i = 0; i < std::min<std::size_t>(5, d.candidates.size()); ++i)
    record["candidates"].push_back({kind_of(d.candidates[i].effect), d.candidates[i].evidence});
}

/// What the data can show, by fits that begin at the truth.
void judge_data(const Case& blind, const std::vector<Measurement>& runs, const Diagnosis& d, json& record) {
  const Noise noise = {.force = 0.05, .torque = 0.002};
  const FitResult base = fit_structure(runs, blind.believed, blind.believed, {}, noise);
  std::vector<std::size_t> hidden;
  for (const HiddenEffect& effect : blind.hidden) hidden.push_back(effect.effect);
  if (blind.rig.unknown != Unknown::none) {
    Case without = blind;
    without.rig.unknown = Unknown::none;
    const double quiet = plain_rms(measure_all(without), blind.rig.plant, all_runs(runs));
    const double with = plain_rms(runs, blind.rig.plant, all_runs(runs));
    record["further_off"] = with / quiet;
    record["shown"] = with / quiet > shown_ratio;
    return;
  }
  if (hidden.empty()) return;
  const FitResult truth = fit_structure(runs, blind.believed, blind.rig.plant, hidden, base.point.noise);
  double evidence = base.objective - truth.objective;
  record["evidence"] = evidence;
  if (hidden.size() == 2)
    for (const std::size_t effect : hidden)
      evidence = std::min(
          evidence,
          fit_structure(runs, blind.believed, blind.rig.plant, {effect}, base.point.noise).objective -
              truth.objective);
  record["least_evidence"] = evidence;
  record["shown"] = evidence > shown_evidence;
  if (hidden.size() != 1) return;
  record["same_force"] = same_force(kind_of(hidden[0]), blind.rig.plant);
  if (d.effects.empty() || d.effects[0].effect == hidden[0]) return;
  const FitResult named =
      fit_structure(runs, blind.believed, d.model, {d.effects[0].effect}, base.point.noise);
  record["worse_if_named"] = named.objective - truth.objective;
}

void judge_gap(const Case& blind, const std::vector<Measurement>& runs, const Diagnosis& d, json& record) {
  const std::vector<std::size_t> held = d.held_out_runs.empty() ? all_runs(runs) : d.held_out_runs;
  const double truth = plain_rms(runs, blind.rig.plant, held);
  record["plain_truth"] = truth;
  record["plain_before"] = plain_rms(runs, blind.believed, held);
  record["plain_after"] = plain_rms(runs, d.model, held);
  record["over_floor"] = record["plain_after"].get<double>() / truth;
}

json describe_case(const Case& blind, const std::string& label, std::size_t number, const Flags& flags) {
  json record = {{"case", number},
                 {"seed", flags.seed},
                 {"label", label},
                 {"size", std::string(name_of(blind.request.size))},
                 {"disturbed", blind.request.disturbed},
                 {"campaign", blind.campaign},
                 {"rate_hz", blind.plans.front().rate_hz},
                 {"hidden", json::array()},
                 {"truth", json::object()},
                 {"experiments", json::array()}};
  for (const std::string& kind : blind.request.hidden) record["hidden"].push_back(kind);
  for (const HiddenEffect& effect : blind.hidden)
    record["truth"][kind_of(effect.effect)] = values_json(effect.effect, effect.values);
  double seconds = 0.0;
  int gaps = 0, falls = 0;
  for (const Plan& plan : blind.plans) {
    gaps += static_cast<int>(plan.gaps_s.size());
    falls += plan.let_go_s ? 1 : 0;
    record["experiments"].push_back(std::string(name_of(plan.experiment)));
    seconds += plan.duration_s;
  }
  record["seconds_of_data"] = seconds;
  record["gaps"] = gaps;
  record["falls"] = falls;
  record["actual_times"] = blind.rig.actual_times;
  record["jitter_s"] = blind.rig.jitter_s;
  record["known_effects"] = json::array();
  for (const PlantEffect& effect : blind.believed.effects)
    record["known_effects"].push_back(kind_of(effect.number));
  return record;
}

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

json run_case(const Flags& flags, std::size_t number) {
  std::string label;
  const Request request = request_of(flags, number, label);
  const Case blind = make_case(request);
  json record = describe_case(blind, label, number, flags);
  const fs::path folder = flags.keep.empty()
                              ? fs::temp_directory_path() / ("diagnosis-matrix-" + std::to_string(getpid()))
                              : fs::path(flags.keep);
  const std::vector<Measurement> runs = through_files(measure_all(blind), folder);
  if (!flags.keep.empty()) {
    write_plant_file(blind.believed, folder / "believed.yaml");
    write_plant_file(blind.rig.plant, folder / "truth.yaml");
    std::ofstream(folder / "case.json") << record.dump(2) << "\n";
  } else {
    fs::remove_all(folder);
  }
  const double cpu_before = cpu_seconds();
  const auto begin = std::chrono::steady_clock::now();
  const Diagnosis d = diagnose(blind.believed, runs);
  record["wall_s"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  record["cpu_s"] = cpu_seconds() - cpu_before;
  describe_diagnosis(d, record);
  judge_data(blind, runs, d, record);
  judge_gap(blind, runs, d, record);
  return record;
}

void append_line(const std::string& file, const std::string& line) {
  const int out = open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  const std::string text = line + "\n";
  if (out < 0 || write(out, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    std::fprintf(stderr, "cannot write %s\n", file.c_str());
  close(out);
}

std::string key_of(const json& record) {
  return record.at("seed").dump() + "/" + record.at("case").dump() + "/" + record.at("disturbed").dump() +
         "/" + record.value("only", "");
}

void run_in_child(const Flags& flags, std::size_t number) {
  alarm(static_cast<unsigned>(flags.most_seconds));
  json record;
  try {
    record = run_case(flags, number);
  } catch (const std::exception& problem) {
    std::string label;
    request_of(flags, number, label);
    record = {{"case", number},
              {"seed", flags.seed},
              {"label", label},
              {"disturbed", flags.disturbed},
              {"failed", problem.what()}};
  }
  if (!flags.only.empty()) record["only"] = flags.only;
  if (flags.timing) record["timing"] = true;
  if (flags.out.empty()) {
    std::cout << record.dump(2) << std::endl;
  } else {
    append_line(flags.out, record.dump());
  }
  _exit(0);
}

void run_matrix(const Flags& flags) {
  std::set<std::string> done;
  for (const json& record : read_records(flags.out)) done.insert(key_of(record));
  std::vector<std::size_t> open_cases;
  for (std::size_t k = flags.one_case.value_or(0); k < (flags.one_case ? *flags.one_case + 1 : flags.cases);
       ++k) {
    const json key = {
        {"seed", flags.seed}, {"case", k}, {"disturbed", flags.disturbed}, {"only", flags.only}};
    if (flags.out.empty() || !done.contains(key_of(key))) open_cases.push_back(k);
  }
  std::map<pid_t, std::size_t> going;
  const auto wait_for_one = [&] {
    int status = 0;
    const pid_t child = wait(&status);
    if (status != 0)
      std::fprintf(stderr, "case %zu ended with status %d (a signal or out of time)\n", going[child], status);
    going.erase(child);
  };
  for (const std::size_t number : open_cases) {
    if (going.size() >= static_cast<std::size_t>(flags.jobs)) wait_for_one();
    const pid_t child = fork();
    if (child == 0) run_in_child(flags, number);
    going[child] = number;
  }
  while (!going.empty()) wait_for_one();
}

Size size_named(const std::string& text) {
  for (const Size size : {Size::weak, Size::typical, Size::strong})
    if (text == name_of(size)) return size;
  throw ConfigError("give --size weak, typical or strong");
}

Flags parse(int argc, char** argv) {
  Flags flags;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--disturbed" || name == "--timing") {
      (name == "--timing" ? flags.timing : flags.disturbed) = true;
      continue;
    }
    if (i + 1 >= argc) throw ConfigError("give a value after " + name);
    const std::string value = argv[++i];
    if (name == "--seed") {
      flags.seed = std::stoull(value);
    } else if (name == "--cases") {
      flags.cases = std::stoull(value);
    } else if (name == "--case") {
      flags.one_case = std::stoull(value);
    } else if (name == "--only") {
      flags.only = value;
    } else if (name == "--size") {
      flags.size = size_named(value);
    } else if (name == "--runs") {
      flags.runs = std::stoi(value);
    } else if (name == "--jobs") {
      flags.jobs = std::max(1, std::stoi(value));
    } else if (name == "--samples") {
      flags.most_samples = std::stod(value);
    } else if (name == "--seconds") {
      flags.most_seconds = std::stod(value);
    } else if (name == "--out") {
      flags.out = value;
    } else if (name == "--markdown") {
      flags.markdown = value;
    } else if (name == "--keep") {
      flags.keep = value;
    } else {
      throw ConfigError("read the top of tests/bench/diagnosis_matrix.cpp: there is no option " + name);
    }
  }
  return flags;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Flags flags = parse(argc, argv);
    if (flags.cases > 0 || flags.one_case) run_matrix(flags);
    if (!flags.markdown.empty()) std::ofstream(flags.markdown) << tables_of(read_records(flags.out));
    return 0;
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "%s\n", problem.what());
    return 2;
  }
}
