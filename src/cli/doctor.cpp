// `upright doctor`: what this machine, and with a rig its link, are good for, on one page with one verdict.
#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "commands.hpp"
#include "commissioning/machine_check.hpp"
#include "commissioning/machine_fix.hpp"
#include "commissioning/rig_check.hpp"
#include "commissioning/wake_probe.hpp"
#include "hal/quanser_proof.hpp"
#include "histogram_json.hpp"
#include "progress.hpp"
#include "record/histogram_text.hpp"
#include "signals.hpp"
#include "upright/base/error.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/hal/simulated_rig.hpp"

namespace upright::cli {

namespace {

using Json = nlohmann::ordered_json;

struct DoctorArguments {
  std::string rig, gains;
  std::optional<double> rate_hz;
  double seconds = 10.0, hand_s = 30.0;
  bool by_hand = false, fix = false, as_json = false;
};

/// What was measured, beside what it means.
struct Page {
  std::vector<Finding> findings;
  double rate_hz = 0.0;
  DurationHistogram idle, loaded;
  std::optional<LinkProbe> link;
};

/// The rate to examine: the one given, the gain file's, or what suits the link.
double rate_of(const DoctorArguments& arguments, const std::optional<RigFile>& rig) {
  constexpr double usual_hz = 1000.0;
  if (arguments.rate_hz) return *arguments.rate_hz;
  if (!arguments.gains.empty()) return read_gain_file(arguments.gains).sample_rate_hz;
  if (!rig || !rig->modbus) return usual_hz;
  return std::min(usual_hz, std::max(lowest_sample_rate_hz, 0.5 / rig->modbus->response_timeout_s));
}

void append(std::vector<Finding>& to, const std::vector<Finding>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

void examine_timing(const DoctorArguments& arguments, double spin_us, Page& page) {
  RealtimeRequest request;
  request.spin_us = spin_us;
  std::fprintf(stderr, "upright: measuring wake-ups, %.0f s idle and %.0f s under load\n", arguments.seconds,
               arguments.seconds);
  Progress progress("wake-ups, idle", arguments.seconds);
  const WakeProbe idle = probe_wake_ups(page.rate_hz, arguments.seconds, false, request);
  progress.begin("wake-ups, loaded", arguments.seconds);
  const WakeProbe loaded = probe_wake_ups(page.rate_hz, arguments.seconds, true, request);
  page.idle = idle.late;
  page.loaded = loaded.late;
  append(page.findings, examine_grant(loaded.grant));
  page.findings.push_back(judge_wake_ups("wake-ups, idle", idle.late, 1.0 / page.rate_hz));
  page.findings.push_back(judge_wake_ups("wake-ups, loaded", loaded.late, 1.0 / page.rate_hz));
}

void ask_operator(const std::string& words) {
  std::fprintf(stderr, "upright: with the amplifier off, %s\n", words.c_str());
}

/// The rig that is examined, at zero volts, and who asks for it to end.
struct ExaminedRig {
  const RigFile& file;
  Rig& rig;
  Clock& clock;
  const SignalFlag& signal;
};

void examine_signs(const DoctorArguments& arguments, const ExaminedRig& at, Page& page) {
  if (arguments.by_hand)
    append(page.findings, examine_signs_by_hand(at.rig, at.clock, calibration_in_use(at.file),
                                                arguments.hand_s, at.signal, ask_operator));
  else
    page.findings.push_back({"encoder signs", Health::not_examined,
                             "cart and pendulum were not moved by hand",
                             "switch the amplifier off and run it with --by-hand"});
}

void examine_lines(const DoctorArguments& arguments, const ExaminedRig& at, const LinkProbe& probe,
                   Page& page) {
  const SafetyInputs inputs = at.rig.safety_inputs();
  append(page.findings, arguments.by_hand ? examine_safety_inputs_by_hand(at.rig, at.clock, arguments.hand_s,
                                                                          at.signal, ask_operator)
                                          : judge_safety_inputs(inputs, probe));
  append(page.findings, name_missing_inputs(inputs));
  if (at.file.gpio) append(page.findings, name_driven_lines(*at.file.gpio));
}

/// It has no link, but lines like any other.
void examine_simulated(const DoctorArguments& arguments, const RigFile& file, Page& page) {
  page.findings.push_back({"link", Health::good, "none: the rig is simulated", ""});
  if (!file.gpio) return;
  const SignalFlag& signal = catch_signals();
  MonotonicClock clock;
  const std::unique_ptr<Rig> rig = assembled(make_simulated_rig(file, clock, {}), file);
  try {
    rig->open();
  } catch (const DeviceError& error) {
    page.findings.push_back({"digital lines", Health::bad, "they are not available", error.what()});
    return;
  }
  std::fprintf(stderr, "upright: reading the digital lines for %.0f s, at zero volts\n", arguments.seconds);
  Progress progress("digital lines", arguments.seconds);
  const LinkProbe probe = probe_link(*rig, clock, page.rate_hz, arguments.seconds, signal);
  progress.end();
  page.findings.push_back(judge_lines(probe));
  examine_lines(arguments, {file, *rig, clock, signal}, probe, page);
  rig->stop();
}

/// False: there is no use in looking further.
bool examine_card(const RigFile& file, Page& page) {
  bool passed = true;
  for (const CardStep& step : prove_quanser_card(file)) {
    page.findings.push_back({step.subject, step.passed ? Health::good : Health::bad, step.what, step.remedy});
    passed = passed && step.passed;
  }
  return passed;
}

void examine_rig(const DoctorArguments& arguments, const RigFile& file, Page& page) {
  if (is_simulated(file)) {
    examine_simulated(arguments, file, page);
    return;
  }
  if (file.quanser && !examine_card(file, page)) return;
  const SignalFlag& signal = catch_signals();
  MonotonicClock clock;
  const std::unique_ptr<Rig> rig = make_rig(file, {1.0 / page.rate_hz});
  rig->open();
  std::fprintf(stderr, "upright: measuring the link for %.0f s, at zero volts\n", arguments.seconds);
  Progress progress("link", arguments.seconds);
  page.link = probe_link(*rig, clock, page.rate_hz, arguments.seconds, signal);
  progress.end();
  page.findings.push_back(judge_link(*page.link, page.rate_hz));
  page.findings.push_back(judge_zero(page.link->counts, calibration_in_use(file)));
  const ExaminedRig at{file, *rig, clock, signal};
  examine_signs(arguments, at, page);
  examine_lines(arguments, at, *page.link, page);
  rig->stop();
}

std::string sentence_for(const Page& page, Health verdict) {
  return verdict_sentence(verdict, page.rate_hz, page.link ? &page.link->round_trip : nullptr);
}

Json json_of(const Page& page, Health verdict) {
  Json findings = Json::array();
  for (const Finding& f : page.findings)
    findings.push_back({{"subject", f.subject},
                        {"health", name_of(f.health)},
                        {"what", f.what},
                        {"remedy", f.remedy.empty() ? Json(nullptr) : Json(f.remedy)}});
  Json document{{"verdict", name_of(verdict)},
                {"sentence", sentence_for(page, verdict)},
                {"findings", findings},
                {"rate_hz", page.rate_hz},
                {"wake_late_idle", histogram_json(page.idle)},
                {"wake_late_loaded", histogram_json(page.loaded)},
                {"link", nullptr}};
  if (page.link) {
    document["link"] = histogram_json(page.link->round_trip);
    document["link"]["failed"] = page.link->failed;
    document["link"]["highest_rate_hz"] = highest_rate_hz(page.link->round_trip);
    if (page.link->device_clock)
      for_each_fact(*page.link->device_clock,
                    [&](const char* name, auto value) { document["link"]["device_clock"][name] = value; });
  }
  return document;
}

void print_histograms(const Page& page) {
  std::vector<NamedHistogram> histograms{{"late, idle", page.idle}, {"late, loaded", page.loaded}};
  const bool has_trips = page.link && page.link->round_trip.count() > 0;
  if (has_trips) histograms.push_back({"link round trip", page.link->round_trip});
  std::printf("\nHistogram of wake-up lateness at %.4g Hz%s (bars: logarithm of the count)\n", page.rate_hz,
              has_trips ? " and of link round trips" : "");
  for (const std::string& line : histogram_lines(histograms)) std::printf("%s\n", line.c_str());
  std::printf("\n");
}

void print(const Page& page, Health verdict) {
  for (const Finding& f : page.findings) {
    std::printf("%-13s %s: %s\n", name_of(f.health), f.subject.c_str(), f.what.c_str());
    if (!f.remedy.empty()) std::printf("              -> %s\n", f.remedy.c_str());
  }
  print_histograms(page);
  std::printf("Verdict: %s.\n", sentence_for(page, verdict).c_str());
  std::fflush(stdout);
}

std::string user_name() {
  const passwd* const user = ::getpwuid(::getuid());  // NOLINT(concurrency-mt-unsafe): before any thread
  return user != nullptr ? user->pw_name : std::to_string(::getuid());
}

/// Prints what a person with root's rights can do for this machine. Changes nothing.
ExitCode print_fixes() {
  if (::geteuid() == 0)
    std::puts("# Root needs no limits and no group: run this as the user who runs the loop to examine them.");
  const std::vector<std::string> lines = commands_to_fix(examine_machine(), user_name());
  std::puts(lines.empty()
                ? "# Nothing needs to be done."
                : "# Nothing has been changed. Choose what suits this machine, and run it as root:");
  for (const std::string& line : lines) std::puts(line.c_str());
  return ExitCode::done;
}

ExitCode run(const DoctorArguments& arguments) {
  if (arguments.fix) {
    if (!arguments.rig.empty() || arguments.as_json)
      throw ConfigError("--fix is about this machine alone: remove --rig and --json");
    return print_fixes();
  }
  std::optional<RigFile> rig;
  if (!arguments.rig.empty()) rig = read_rig_file(arguments.rig);
  Page page;
  page.rate_hz = rate_of(arguments, rig);
  page.findings = examine_machine();
  examine_timing(arguments, rig ? rig->spin_us : 0.0, page);
  if (rig) examine_rig(arguments, *rig, page);
  const Health verdict = verdict_of(page.findings);
  if (arguments.as_json)
    std::cout << json_of(page, verdict).dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  else
    print(page, verdict);
  return verdict == Health::bad ? ExitCode::device : ExitCode::done;
}

}  // namespace

void add_doctor(CommandLine& line) {
  const Command command =
      line.command("doctor", "Test the timing of this machine and, with --rig, the link and wiring of a rig",
                   "Examples:\n"
                   "  upright doctor --rig config/rigs/modbus-tcp.yaml --rate 500\n"
                   "  upright doctor --fix\n"
                   "It keeps the motor at zero volts. Every problem comes with a remedy.\n"
                   "Exit code 4 means that the verdict is bad.");
  const auto a = std::make_shared<DoctorArguments>();
  command.option("--rig", a->rig, "Rig file; its link and wiring are tested too");
  command.option("--gains", a->gains, "Gain file; its sample rate is tested");
  command
      .option("--rate", a->rate_hz,
              "Sample rate to test [Hz] (default: that of --gains, else 1000 or what the link allows)")
      .in(Range::within(lowest_sample_rate_hz, highest_sample_rate_hz));
  constexpr double longest_s = 3600.0;
  command.option("--seconds", a->seconds, "Duration of each measurement [s] (default: 10)")
      .in({0.0, longest_s, true});
  command.flag(
      "--by-hand", a->by_hand,
      "Test encoder signs, emergency stop and limit switches; asks you to move or press them by hand");
  command.option("--hand-wait", a->hand_s, "How long to wait for each movement by hand [s] (default: 30)")
      .in({0.0, longest_s, true});
  command.flag("--fix", a->fix,
               "Print the commands that make this machine suitable; measures and changes nothing");
  command.flag("--json", a->as_json, "Print one JSON document");
  command.does([a] { return run(*a); });
}

}  // namespace upright::cli
