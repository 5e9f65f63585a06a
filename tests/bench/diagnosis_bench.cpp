// What a diagnosis costs: processor time and followed samples, of fixed cases or of files.
//
//   diagnosis_bench [--phases] [--quick] [--laboratory] [NUMBER...]
//   diagnosis_bench [--phases] [--quick] PLANT RUN...
//
// NUMBERs choose among the cases of a fixed seed (default: the first six): six runs of ten seconds at 500 Hz,
// or seven at 1 kHz as in a laboratory. --phases lists the processor time by what the diagnosis said it was
// doing. To compare two programs, run both in turns: the processor time of a busy machine varies by a third.
#include <sys/resource.h>
#include <sys/time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "blind_case.hpp"
#include "upright/diagnosis/diagnosis.hpp"
#include "upright/measurement/measurement.hpp"
#include "upright/model/plant_file.hpp"

namespace {

using namespace upright;

struct Flags {
  bool phases = false;
  bool laboratory = false;
  bool quick = false;
  std::vector<std::string> names;
};

double processor_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// The processor time between one report of progress and the next, by what it said.
class Phases {
 public:
  void enter(const std::string& what) {
    const double now_s = processor_s();
    spent_s_[phase_] += now_s - entered_s_;
    entered_s_ = now_s;
    phase_ = what;
    ++entries_[what];
  }
  void print() const {
    std::vector<std::pair<double, std::string>> rows;
    for (const auto& [phase, spent_s] : spent_s_) rows.emplace_back(spent_s, phase);
    std::sort(rows.rbegin(), rows.rend());
    for (const auto& [spent_s, phase] : rows)
      std::printf("    %8.2f s in %3d times  %s\n", spent_s,
                  entries_.contains(phase) ? entries_.at(phase) : 1, phase.c_str());
  }

 private:
  std::map<std::string, double> spent_s_;
  std::map<std::string, int> entries_;
  std::string phase_ = "begin";
  double entered_s_ = processor_s();
};

void measure(const std::string& name, const Plant& plant, const std::vector<Measurement>& runs,
             const Flags& flags) {
  double samples = 0.0;
  for (const Measurement& run : runs) samples += static_cast<double>(run.size());
  Phases phases;
  DiagnosisOptions options;
  options.progress = [&](double, const std::string& what) { phases.enter(what); };
  options.quick = flags.quick;
  const double begin_s = processor_s();
  const Diagnosis d = diagnose(plant, runs, options);
  phases.enter("end");
  const double spent_s = processor_s() - begin_s;
  std::string found;
  for (const FoundEffect& effect : d.effects) found += " " + kind_of(effect.effect);
  std::printf("%-28s %8.0f samples %8.2f s of processor time, each sample followed %5.0f times: %s%s\n",
              name.c_str(), samples, spent_s, d.work_samples / samples,
              std::string(name_of(d.verdict)).c_str(), found.c_str());
  if (flags.phases) phases.print();
  std::fflush(stdout);
}

/// A fixed case: every third one hides nothing, every third one what the registry lacks.
blind::Case fixed_case(std::size_t number, bool laboratory) {
  blind::Request request;
  request.condition = laboratory ? blind::Condition::laboratory : blind::Condition::quantized;
  const std::vector<std::string> unknown = blind::unknown_kinds(request.condition);
  const std::vector<std::string> known = {"coulomb_friction", "cogging_force", "motor_lag", "cable_spring"};
  if (number % 3 == 0) request.hidden = {known[number / 3 % known.size()]};
  if (number % 3 == 1) request.hidden = {unknown[number / 3 % unknown.size()]};
  constexpr std::uint64_t first_seed = 77000;
  request.seed = first_seed + number;
  request.runs = laboratory ? 7 : 6;
  request.rate_hz = laboratory ? 1000.0 : 500.0;
  request.duration_s = 10.0;
  request.max_samples = request.runs * request.rate_hz * request.duration_s;
  return blind::make_case(request);
}

void measure_fixed(const Flags& flags) {
  std::vector<std::string> numbers = flags.names;
  if (numbers.empty()) numbers = {"0", "1", "2", "3", "4", "5"};
  for (const std::string& number : numbers) {
    const blind::Case fixed = fixed_case(std::stoul(number), flags.laboratory);
    const std::string hidden = fixed.request.hidden.empty() ? "none" : fixed.request.hidden.front();
    measure(number + " " + hidden, fixed.believed, blind::measure_all(fixed), flags);
  }
}

Flags parse(int argc, char** argv) {
  Flags flags;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--phases") {
      flags.phases = true;
    } else if (argument == "--laboratory") {
      flags.laboratory = true;
    } else if (argument == "--quick") {
      flags.quick = true;
    } else {
      flags.names.push_back(argument);
    }
  }
  return flags;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Flags flags = parse(argc, argv);
    if (flags.names.empty() || !std::filesystem::exists(flags.names.front())) {
      measure_fixed(flags);
      return 0;
    }
    const std::vector<std::filesystem::path> runs(flags.names.begin() + 1, flags.names.end());
    measure(flags.names.front(), read_plant_file(flags.names.front()), read_measurements(runs), flags);
    return 0;
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "%s\n", problem.what());
    return 2;
  }
}
