#include "process_case.hpp"

#include <signal.h>
#include <sys/resource.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "evidence.hpp"

namespace upright::test {

namespace {

std::string shim_words(Disturbance kind, double amount) {
  return std::to_string(static_cast<int>(kind)) + " 0.8 " + std::to_string(amount);
}

Action standing_still(double for_s) {
  return [for_s](const Running& run) {
    kill(run.controller, SIGSTOP);
    sleep_s(for_s);
    return kill(run.controller, SIGCONT) == 0;
  };
}

Action signalled(int number) {
  return [number](const Running& run) { return kill(run.controller, number) == 0; };
}

bool limit(pid_t process, __rlimit_resource resource, rlim_t max_value) {
  const rlimit limits{max_value, max_value};
  return prlimit(process, resource, &limits, nullptr) == 0;
}

bool fill_the_disk(const Running& run) {
  constexpr rlim_t room = 70'000;
  return limit(run.controller, RLIMIT_FSIZE, room);
}

bool grant_no_more_memory(const Running& run) {
  std::ifstream in("/proc/" + std::to_string(run.controller) + "/statm");
  rlim_t pages = 0;
  in >> pages;
  return pages > 0 && limit(run.controller, RLIMIT_AS, pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)));
}

bool start_a_second(const Running& run) {
  constexpr int device_error = 4;
  Process second(run.command);
  second.rest();
  return second.wait() == device_error;
}

bool overwrite_rig_file(const Running& run) {
  return static_cast<bool>(std::ofstream(run.rig_file) << "backend: none\n");
}

std::vector<ProcessCase> log_cases() {
  constexpr double log_patience_s = 2.0, round_s = 0.05, long_enough_s = 4.0;
  const Expectation log_stands = stops({"log_failed"}, log_patience_s + round_s);
  return {
      {.fault = "disk_full",
       .expectation = stops({"log_failed"}, round_s),
       .action = fill_the_disk,
       .begins = Begins::when_the_log_ends,
       .duration_s = 8.0},
      {.fault = "slow_disk", .expectation = goes_on(), .shim = shim_words(Disturbance::slow_writes, 0.3)},
      {.fault = "dead_disk",
       .expectation = log_stands,
       .shim = shim_words(Disturbance::one_slow_write, 3.0),
       .begins = Begins::when_the_shim_strikes,
       .duration_s = long_enough_s},
      {.fault = "writer_killed",
       .expectation = log_stands,
       .shim = shim_words(Disturbance::kill_writer, 0.0),
       .begins = Begins::when_the_shim_strikes,
       .duration_s = long_enough_s},
  };
}

}  // namespace

void sleep_s(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

std::vector<ProcessCase> machine_cases(double period_s, const Expectation& stood_still) {
  const auto done = [](const char* fault, Expectation expectation, Action action) {
    return ProcessCase{.fault = fault,
                       .expectation = std::move(expectation),
                       .action = std::move(action),
                       .begins = Begins::when_done};
  };
  std::vector<ProcessCase> cases = {
      done("missed_cycles", goes_on(), standing_still(short_standstill_s)),
      done("overrun", stood_still, standing_still(0.25)),
      done("sigterm", stops({"signal"}, period_s), signalled(SIGTERM)),
      {.fault = "clock_step", .expectation = goes_on(), .shim = shim_words(Disturbance::step_clock, 3600.0)},
      done("memory", goes_on(), grant_no_more_memory),
      done("two_controllers", goes_on(), start_a_second),
      done("rig_file_changed", goes_on(), overwrite_rig_file),
  };
  for (ProcessCase& c : log_cases()) cases.push_back(std::move(c));
  return cases;
}

std::vector<ProcessCase> sign_cases() {
  const auto wrong = [](const char* fault, const char* key) {
    return ProcessCase{.fault = fault,
                       .expectation = stops({"fell", "track_limit"}, 1.5),
                       .turned = key,
                       .begins = Begins::at_the_start,
                       .duration_s = 3.0};
  };
  return {wrong("sign_amplifier", "amplifier: {limit_v"), wrong("sign_cart", "cart: {m_per_count"),
          wrong("sign_pendulum", "pendulum: {counts_per_revolution")};
}

std::string as_read(const ProcessCase& c, std::string rig_text) {
  if (c.turned.empty()) return rig_text;
  const std::string right = ", sign: 1";
  const std::size_t key = rig_text.find(c.turned);
  const std::size_t sign = key == std::string::npos ? key : rig_text.find(right, key);
  if (sign == std::string::npos) throw std::runtime_error("no sign to turn: " + c.turned);
  return rig_text.replace(sign, right.size(), ", sign: -1");
}

std::vector<std::string> RunFolder::command(double duration_s) const {
  return {UPRIGHT_BINARY, "run",       "--rig",      rig_file(),
          "--gains",      gain_file(), "--duration", std::to_string(duration_s),
          "--out",        runs(),      "--json",     "--unchecked"};
}

ProcessFiles RunFolder::files(double duration_s) const {
  return {command(duration_s), rig_file(), runs(), folder_ / "struck"};
}

std::optional<double> run_with(const ProcessCase& c, const ProcessFiles& files) {
  std::vector<std::string> command = files.command;
  if (!c.shim.empty())
    command.insert(command.begin(), {"env", "LD_PRELOAD=" UPRIGHT_SHIM_LIBRARY, "UPRIGHT_SHIM=" + c.shim,
                                     "UPRIGHT_SHIM_MARK=" + files.mark.string()});
  Process controller(command);
  double done_s = 0.0;
  if (c.action) {
    if (!wait_for_rows(files.runs)) return std::nullopt;
    sleep_s(0.3);
    done_s = monotonic_s();
    if (!c.action({controller.id(), files.command, files.rig_file})) return std::nullopt;
  }
  controller.rest();
  controller.wait();
  if (!c.shim.empty() && !std::filesystem::exists(files.mark)) return std::nullopt;
  return done_s;
}

std::optional<double> kill_run(const ProcessFiles& files) {
  Process controller(files.command);
  if (!wait_for_rows(files.runs)) return std::nullopt;
  sleep_s(0.3);
  const double killed_s = monotonic_s();
  constexpr int by_a_signal = -1;
  if (controller.end(SIGKILL) != by_a_signal) return std::nullopt;
  return killed_s;
}

double begin_of(const ProcessCase& c, const ProcessFiles& files, double first_s, double injected_s,
                double done_s) {
  switch (c.begins) {
    case Begins::when_injected:
      return injected_s;
    case Begins::when_done:
      return done_s;
    case Begins::when_the_shim_strikes:
      return std::stod(text_of(files.mark));
    case Begins::when_the_log_ends:
      return log_end_s(only_entry(files.runs));
    case Begins::at_the_start:
      break;
  }
  return first_s;
}

double let_go_s(const std::vector<TraceRow>& trace) {
  for (const TraceRow& row : trace)
    if (!row.held) return row.time_s;
  return 0.0;
}

double last_voltage_s(const std::vector<TraceRow>& trace) {
  double on_until_s = 0.0;
  for (const TraceRow& row : trace)
    if (row.voltage_v != 0.0) on_until_s = row.time_s;
  return on_until_s;
}

}  // namespace upright::test
