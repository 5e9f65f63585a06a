// The matrix: how often the diagnosis names the effect that is hidden in data from a rig that is not its
// model.
//
//   diagnosis_matrix --out FILE.jsonl --first N --count M [--seed N] [--disturbed | --laboratory]
//                    [--only KIND] [--size weak|typical|strong] [--runs N] [--samples N] [--jobs J]
//                    [--seconds S] [--timing]
//   diagnosis_matrix --markdown FILE.md --records FILE.jsonl [--records FILE.jsonl ...]
//   diagnosis_matrix --case K [--keep DIR [--data-only]] [...]
//
// Cases are numbered from 0 and follow from the seed and the number, so that pieces of a matrix can be run
// anywhere: --first and --count choose them (--cases N: the first N). Each runs in a process of its own and
// adds one line to FILE.jsonl; what is there already is not run again, so that a matrix can be stopped and
// continued.
// --seconds is the processor time that a diagnosis may take. A case that takes longer, or fails otherwise, is
// a line too, and counts as missed. The judgement of the data may take ten times as long.
// --markdown writes the tables of all records; a case that is in several files counts once.
// --timing makes every case six runs of ten seconds at 500 Hz, of a laboratory seven at 1 kHz; with --jobs 1
// their wall time is the figure of the table. UPRIGHT_THREADS=1 keeps a case on one processor.
// --case K with --keep DIR writes the plant file, the runs and the truth of one case, for `upright diagnose`;
// with --data-only it is not diagnosed here.
//
// The diagnosis works as the command does: the runs are written as CSV and read again, and it sees nothing
// else. diagnosis_judge.hpp says what "visible" and "distinguishable" mean; tests/blind says how cases are
// made.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "blind_case.hpp"
#include "diagnosis/diagnosis_json.hpp"
#include "diagnosis_judge.hpp"
#include "diagnosis_tables.hpp"
#include "upright/base/error.hpp"
#include "upright/diagnosis/diagnosis.hpp"
#include "upright/model/plant_file.hpp"

namespace {

using namespace upright;
using namespace upright::blind;
using nlohmann::json;
namespace fs = std::filesystem;

/// Processor time of the judgement of a case, relative to what its diagnosis may take.
constexpr double judgement_share = 10.0;

struct Flags {
  std::uint64_t seed = 1;
  std::size_t first = 0, count = 0;
  std::string only, out, markdown, keep;
  std::vector<std::string> records;
  std::optional<Size> size;
  Condition condition = Condition::quantized;
  int runs = 0, jobs = 1;
  double max_samples = 12000.0;
  bool timing = false, data_only = false;
  double max_seconds = 900.0;
};

/// One round: every effect of the registry once, rigs with nothing hidden, eight pairs, each unknown twice.
/// Of 1000 cases of a laboratory, more than 300 have nothing hidden.
std::vector<std::string> round_of_labels(Condition condition) {
  std::vector<std::string> labels = hidden_kinds();
  const std::size_t nulls = condition == Condition::laboratory ? 28 : 6;
  labels.insert(labels.end(), nulls, "none");
  labels.insert(labels.end(), 8, "pair");
  for (int i = 0; i < 2; ++i)
    for (const std::string& kind : unknown_kinds(condition)) labels.push_back(kind);
  // Spread over the round, so that the first cases are as varied as all.
  std::vector<std::string> spread;
  constexpr std::size_t stride = 13;
  for (std::size_t first = 0; first < stride; ++first)
    for (std::size_t i = first; i < labels.size(); i += stride) spread.push_back(labels[i]);
  return spread;
}

Request request_of(const Flags& flags, std::size_t number, std::string& label) {
  static const std::vector<std::string> labels = round_of_labels(flags.condition);
  const std::size_t round = number / labels.size();
  label = flags.only.empty() ? labels[number % labels.size()] : flags.only;
  Request request;
  request.seed = seed_of_case(flags.seed, number);
  request.size = flags.size.value_or(static_cast<Size>((number + round) % 3));
  // Drawn, so that no kind goes with a size: a round has as many places for each as sizes.
  if (flags.condition == Condition::laboratory && !flags.size)
    request.size = static_cast<Size>(std::mt19937_64(request.seed)() % 3);
  request.condition = flags.condition;
  request.runs = flags.runs;
  request.max_samples = flags.max_samples;
  if (flags.timing) {
    const bool laboratory = flags.condition == Condition::laboratory;
    request.runs = laboratory ? 7 : 6;
    request.rate_hz = laboratory ? 1000.0 : 500.0;
    request.duration_s = 10.0;
    request.max_samples = request.runs * request.rate_hz * request.duration_s;
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

json values_json(std::size_t effect, const std::vector<double>& values) {
  json result = json::object();
  const EffectInfo& info = effect_registry()[effect];
  for (std::size_t i = 0; i < info.parameters.size(); ++i)
    result[std::string(info.parameters[i].name)] = values[i];
  return result;
}

/// From the document that the program writes, so that it counts what a user reads: an effect that is listed
/// as helping at some places only is not named.
void describe_diagnosis(const Diagnosis& d, json& record) {
  const json document = json::parse(diagnosis_json(d));
  record["verdict"] = document.at("verdict");
  record["gap_before"] = document.at("gap").at("before");
  record["gap_after"] = document.at("gap").at("after");
  record["residual"] = document.at("residual");
  record["noise"] = document.at("noise");
  record["notes"] = document.at("notes");
  record["residual_tests"] = document.at("residual_tests");
  record["bound_reached"] = document.value("bound_reached", false);
  record["found"] = json::array();
  for (const json& effect : document.at("effects")) {
    json found = {{"kind", effect.at("kind")},
                  {"enters", effect.at("enters")},
                  {"gap_after", effect.at("gap_after")},
                  {"confusable_with", effect.at("confusable_with")},
                  {"parameters", json::object()}};
    for (const auto& [name, p] : effect.at("parameters").items())
      if (p.contains("ci95"))
        found["parameters"][name] = {
            {"value", p.at("value")}, {"low", p.at("ci95").at(0)}, {"high", p.at("ci95").at(1)}};
    record["found"].push_back(found);
  }
  if (document.contains("helps_here_only")) record["helps_here_only"] = document.at("helps_here_only");
  record["candidates"] = json::array();
  for (const json& candidate : document.at("candidates")) {
    if (record["candidates"].size() == 5) break;
    record["candidates"].push_back({candidate.at("kind"), candidate.at("evidence")});
  }
}

/// What a record says of a case without making it.
json describe_request(const Flags& flags, std::size_t number) {
  std::string label;
  const Request request = request_of(flags, number, label);
  json record = {{"case", number},
                 {"seed", flags.seed},
                 {"label", label},
                 {"size", std::string(name_of(request.size))},
                 {"condition", std::string(name_of(request.condition))},
                 {"disturbed", request.condition == Condition::disturbed},
                 {"hidden", request.hidden}};
  if (!flags.only.empty()) record["only"] = flags.only;
  if (flags.timing) record["timing"] = true;
  return record;
}

/// What a correct diagnosis finds of the numbers of the plant file.
json file_truth(const Plant& believed, const Plant& truth) {
  json result = json::object();
  const auto base = [&](const char* kind, double from, double to) {
    const PlantEffect* hidden = truth.find(kind);
    result[kind] = {{"scale", to / from * (hidden != nullptr ? hidden->values[0] : 1.0)}};
  };
  base("cart_mass", believed.cart_mass_kg, truth.cart_mass_kg);
  base("back_emf", believed.motor.back_emf_n_per_mps, truth.motor.back_emf_n_per_mps);
  if (truth.pendulum) {
    base("pendulum_mass", believed.pendulum->mass_kg, truth.pendulum->mass_kg);
    base("pendulum_length", believed.pendulum->length_to_com_m, truth.pendulum->length_to_com_m);
  }
  for (const PlantEffect& effect : believed.effects)
    if (const PlantEffect* there = truth.find(effect.number))
      result[kind_of(effect.number)] =
          values_json(effect.number, {there->values.begin(), there->values.end()});
  return result;
}

void describe_rig(const Case& blind, json& record) {
  record["file_truth"] = file_truth(blind.believed, blind.rig.plant);
  record["cart_mass_kg"] = blind.believed.cart_mass_kg;
  record["cart_step_m"] = blind.rig.cart_step_m;
  record["jitter_s"] = blind.rig.jitter_s;
  record["actual_times"] = blind.rig.actual_times;
  if (blind.request.condition != Condition::laboratory) return;
  const ColouredDisturbance& coloured = blind.rig.coloured;
  record["coloured"] = {{"force_n", coloured.force_n},
                        {"force_time_s", coloured.force_time_s},
                        {"torque_nm", coloured.torque_nm},
                        {"torque_time_s", coloured.torque_time_s},
                        {"speed_mps", coloured.speed_mps}};
  record["rough_n"] = blind.rig.rough_n;
  record["rough_length_m"] = blind.rig.rough_length_m;
  record["cart_noise_m"] = blind.rig.cart_noise_m;
  record["theta_noise_rad"] = blind.rig.theta_noise_rad;
  record["noise_colour"] = blind.rig.noise_colour;
  record["unknown_size"] = blind.rig.unknown_size;
  record["unknown_period"] = blind.rig.unknown_period;
}

void describe_case(const Case& blind, json& record) {
  record["campaign"] = blind.campaign;
  record["rate_hz"] = blind.plans.front().rate_hz;
  record["unknown"] = blind.rig.unknown != Unknown::none;
  record["truth"] = json::object();
  record["experiments"] = json::array();
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
  record["known_effects"] = json::array();
  for (const PlantEffect& effect : blind.believed.effects)
    record["known_effects"].push_back(kind_of(effect.number));
  describe_rig(blind, record);
}

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// From here on the process may take this much processor time.
void limit_processor_time(double seconds) {
  const auto whole = static_cast<time_t>(seconds);
  const itimerval timer{{}, {whole, static_cast<suseconds_t>(1e6 * (seconds - static_cast<double>(whole)))}};
  setitimer(ITIMER_PROF, &timer, nullptr);
}

/// Sends what is known of a case to the process that waits for it.
void send(int to, json record, const char* stage) {
  if (stage != nullptr) record["stage"] = stage;
  const std::string line = record.dump() + "\n";
  if (write(to, line.data(), line.size()) != static_cast<ssize_t>(line.size())) _exit(1);
}

void run_case(const Flags& flags, std::size_t number, int to) {
  std::string label;
  json record = describe_request(flags, number);
  send(to, record, "simulation");
  const Case blind = make_case(request_of(flags, number, label));
  describe_case(blind, record);
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
  if (flags.data_only) return send(to, record, nullptr);
  send(to, record, "judgement of the data");
  const DataJudgement data = judge_data(blind, runs, record);
  send(to, record, "diagnosis");
  limit_processor_time(flags.max_seconds);
  const double cpu_before = cpu_seconds();
  const auto begin = std::chrono::steady_clock::now();
  const Diagnosis d = diagnose(blind.believed, runs);
  record["wall_s"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  record["cpu_s"] = cpu_seconds() - cpu_before;
  limit_processor_time(judgement_share * flags.max_seconds);
  describe_diagnosis(d, record);
  send(to, record, "judgement of the diagnosis");
  judge_name(blind, runs, data, d, record);
  judge_gap(blind, runs, d, record);
  send(to, record, nullptr);
}

void append_line(const std::string& file, const std::string& line) {
  const int out = open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  const std::string text = line + "\n";
  if (out < 0 || write(out, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    std::fprintf(stderr, "cannot write %s\n", file.c_str());
  close(out);
}

void run_in_child(const Flags& flags, std::size_t number, int to) {
  limit_processor_time(judgement_share * flags.max_seconds);
  try {
    run_case(flags, number, to);
  } catch (const std::exception& problem) {
    json record = describe_request(flags, number);
    record["failed"] = problem.what();
    send(to, record, nullptr);
  }
  _exit(0);
}

/// A process that works on a case, and what it sends.
struct Going {
  std::size_t number = 0;
  int from = -1;
};

Going start_case(const Flags& flags, std::size_t number, pid_t& child) {
  int ends[2];
  if (pipe(ends) != 0)
    throw std::runtime_error("cannot make a pipe: close programs that have many files open");
  child = fork();
  if (child < 0) throw std::runtime_error("cannot start a process: close other programs");
  if (child == 0) {
    close(ends[0]);
    run_in_child(flags, number, ends[1]);
  }
  close(ends[1]);
  return {number, ends[0]};
}

/// The last whole line that a case sent: complete, or with the reason why it is not. All of it fits into the
/// buffer of a pipe.
json result_of(const Flags& flags, const Going& going, int status) {
  std::string text;
  char buffer[4096];
  for (ssize_t n = 0; (n = read(going.from, buffer, sizeof buffer)) > 0;)
    text.append(buffer, static_cast<std::size_t>(n));
  close(going.from);
  json record = describe_request(flags, going.number);
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    json sent = json::parse(line, nullptr, false);
    if (!sent.is_discarded()) record = std::move(sent);
  }
  if (status == 0 && !record.contains("stage")) return record;
  const std::string stage = record.value("stage", "start");
  const bool late = WIFSIGNALED(status) && WTERMSIG(status) == SIGPROF;
  record["failed"] = stage + (late ? " took too long" : " ended with status " + std::to_string(status));
  record["out_of_time"] = late;
  return record;
}

void report(const Flags& flags, const json& record) {
  if (flags.out.empty()) {
    std::cout << record.dump(2) << std::endl;
  } else {
    append_line(flags.out, record.dump());
  }
}

void run_matrix(const Flags& flags) {
  std::set<std::string> done;
  for (const json& record : read_records({flags.out})) done.insert(key_of(record));
  std::map<pid_t, Going> working;
  const auto wait_for_one = [&] {
    int status = 0;
    const auto ended = working.find(wait(&status));
    report(flags, result_of(flags, ended->second, status));
    working.erase(ended);
  };
  for (std::size_t number = flags.first; number < flags.first + flags.count; ++number) {
    if (!flags.out.empty() && done.contains(key_of(describe_request(flags, number)))) continue;
    if (working.size() >= static_cast<std::size_t>(flags.jobs)) wait_for_one();
    pid_t child = 0;
    const Going going = start_case(flags, number, child);
    working[child] = going;
  }
  while (!working.empty()) wait_for_one();
}

Size size_named(const std::string& text) {
  for (const Size size : {Size::weak, Size::typical, Size::strong})
    if (text == name_of(size)) return size;
  throw ConfigError("give --size weak, typical or strong");
}

/// A flag without a value.
bool is_switch(const std::string& name, Flags& flags) {
  if (name == "--timing") {
    flags.timing = true;
  } else if (name == "--data-only") {
    flags.data_only = true;
  } else if (name == "--disturbed") {
    flags.condition = Condition::disturbed;
  } else if (name == "--laboratory") {
    flags.condition = Condition::laboratory;
  } else {
    return false;
  }
  return true;
}

Flags parse(int argc, char** argv) {
  Flags flags;
  const std::map<std::string, std::function<void(const std::string&)>> options = {
      {"--seed", [&](const std::string& value) { flags.seed = std::stoull(value); }},
      {"--first", [&](const std::string& value) { flags.first = std::stoull(value); }},
      {"--count", [&](const std::string& value) { flags.count = std::stoull(value); }},
      {"--cases", [&](const std::string& value) { flags.count = std::stoull(value); }},
      {"--case",
       [&](const std::string& value) {
         flags.first = std::stoull(value);
         flags.count = 1;
       }},
      {"--only", [&](const std::string& value) { flags.only = value; }},
      {"--size", [&](const std::string& value) { flags.size = size_named(value); }},
      {"--runs", [&](const std::string& value) { flags.runs = std::stoi(value); }},
      {"--jobs", [&](const std::string& value) { flags.jobs = std::max(1, std::stoi(value)); }},
      {"--samples", [&](const std::string& value) { flags.max_samples = std::stod(value); }},
      {"--seconds", [&](const std::string& value) { flags.max_seconds = std::stod(value); }},
      {"--out", [&](const std::string& value) { flags.out = value; }},
      {"--records", [&](const std::string& value) { flags.records.push_back(value); }},
      {"--markdown", [&](const std::string& value) { flags.markdown = value; }},
      {"--keep", [&](const std::string& value) { flags.keep = value; }},
  };
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (is_switch(name, flags)) continue;
    const auto option = options.find(name);
    if (option == options.end())
      throw ConfigError("read the top of tests/bench/diagnosis_matrix.cpp: there is no option " + name);
    if (i + 1 >= argc) throw ConfigError("give a value after " + name);
    option->second(argv[++i]);
  }
  if (!flags.out.empty()) flags.records.push_back(flags.out);
  return flags;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Flags flags = parse(argc, argv);
    run_matrix(flags);
    if (!flags.markdown.empty()) std::ofstream(flags.markdown) << tables_of(read_records(flags.records));
    return 0;
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "%s\n", problem.what());
    return 2;
  }
}
