// A fault that befalls `upright run` as a process of its own, and how such a run goes, whatever rig it
// drives.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "../integration/virtual_rig_process.hpp"
#include "fault_table.hpp"
#include "shim.hpp"

namespace upright::test {

/// A run that balances, for a case to do something to.
struct Running {
  pid_t controller = 0;
  std::vector<std::string> command;  ///< that started it
  std::filesystem::path rig_file;
};

/// False: it could not be done, for the run was over before.
using Action = std::function<bool(const Running&)>;

/// When a fault begins.
enum class Begins { when_injected, when_done, when_the_shim_strikes, when_the_log_ends, at_the_start };

struct ProcessCase {
  const char* fault = "";
  Expectation expectation;
  std::string turned = {};  ///< whose sign the controller's rig file has wrong, not the plant's
  std::string shim = {};    ///< UPRIGHT_SHIM of the controller
  Action action = {};
  Begins begins = Begins::when_injected;
  double duration_s = 1.5;
};

/// Faults of the machine under the controller, of its log and of whoever else is there. `stood_still` is what
/// has to come of 250 ms without the controller: who takes the voltage away is the rig's affair.
std::vector<ProcessCase> machine_cases(double period_s, const Expectation& stood_still);

/// Encoders and amplifiers that are wired the wrong way round.
std::vector<ProcessCase> sign_cases();

/// A rig file's text as the controller of `c` reads it.
std::string as_read(const ProcessCase& c, std::string rig_text);

void sleep_s(double seconds);

/// How a run is started and what it leaves.
struct ProcessFiles {
  std::vector<std::string> command;
  std::filesystem::path rig_file, runs, mark;
};

/// A folder with the rig file and the gain file of an `upright run`, and the folder of its runs.
class RunFolder {
 public:
  std::filesystem::path rig_file() const { return folder_ / "rig.yaml"; }
  std::filesystem::path gain_file() const { return folder_ / "gains.yaml"; }
  std::filesystem::path runs() const { return folder_ / "runs"; }
  std::vector<std::string> command(double duration_s) const;
  ProcessFiles files(double duration_s) const;

 protected:
  const Folder& folder() const { return folder_; }

 private:
  Folder folder_;
};

/// Runs `c` to its end. When its action was begun, 0 without one; none: the run does not begin, or ends
/// before its fault comes about.
std::optional<double> run_with(const ProcessCase& c, const ProcessFiles& files);

/// Kills a run that balances. When, on the monotonic clock; none: the run does not begin, or ends before.
std::optional<double> kill_run(const ProcessFiles& files);

/// When the fault began, on the monotonic clock; `injected_s` is when the rig brings it about by itself.
double begin_of(const ProcessCase& c, const ProcessFiles& files, double first_s, double injected_s,
                double done_s);

/// When the rig let the pendulum go.
double let_go_s(const std::vector<TraceRow>& trace);
/// When the motor was on last; 0: never.
double last_voltage_s(const std::vector<TraceRow>& trace);

}  // namespace upright::test
