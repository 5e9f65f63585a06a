#include "fault_table.hpp"

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace upright::test {

namespace {

constexpr std::array benches = {"simulated-fast", "simulated-real-time", "modbus-tcp", "modbus-rtu"};

std::filesystem::path file_of(const std::filesystem::path& records, const std::string& fault,
                              std::size_t bench) {
  return records / (fault + "." + benches.at(bench));
}

std::string text_or(const std::filesystem::path& file, const std::string& otherwise) {
  std::ifstream in(file);
  if (!in) return otherwise;
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

const std::vector<Fault>& faults() {
  static const std::vector<Fault> list = {
      {"missed_cycles", "the controller stands still for 20 ms"},
      {"overrun", "the controller stands still for 250 ms"},
      {"stuck_cart", "the cart's encoder stops counting"},
      {"stuck_pendulum", "the pendulum's encoder stops counting"},
      {"jump", "the cart's counts jump by 5000 and stay there"},
      {"wrap", "16-bit counters wrap during the motion"},
      {"sign_amplifier", "`amplifier.sign` is wrong"},
      {"sign_cart", "`calibration.cart.sign` is wrong"},
      {"sign_pendulum", "`calibration.pendulum.sign` is wrong"},
      {"nan", "the controller computes a value that is not a number"},
      {"late", "one reply in 20 is late"},
      {"drop", "one reply in 20 is lost"},
      {"corrupt", "one reply in 20 has a wrong bit"},
      {"stale", "one reply in 20 is the one before, once more"},
      {"reorder", "one reply in 20 leaves after the next one"},
      {"silent", "no reply comes any more"},
      {"always_late", "every reply comes too late"},
      {"cut", "the link is cut"},
      {"restart", "the device restarts"},
      {"emergency_stop", "the emergency stop is pressed"},
      {"limit_switch", "a limit switch is hit"},
      {"line_failed", "a digital line cannot be read any more"},
      {"edges_lost", "edges of a line encoder are lost"},
      {"edges_too_fast", "edges of a line encoder come too fast"},
      {"disk_full", "the disk is full"},
      {"slow_disk", "each write and sync of the log takes 0.3 s"},
      {"dead_disk", "one write of the log takes 3 s"},
      {"writer_killed", "the log's writer thread is killed"},
      {"sigterm", "SIGTERM"},
      {"sigkill", "SIGKILL"},
      {"clock_step", "the wall clock steps by an hour"},
      {"memory", "no further memory is granted"},
      {"two_controllers", "a second controller is started on the same machine (it is refused)"},
      {"rig_file_changed", "the rig file is overwritten during the run"},
  };
  return list;
}

std::string cell_of(const Expectation& expectation) {
  std::string cell = expectation.may_go_on ? "goes on" : "";
  for (const std::string& reason : expectation.reasons) {
    cell += cell.empty() ? "`" : " or `";
    cell += reason;
    cell += "`";
  }
  if (expectation.reasons.empty()) return cell;
  cell += ", 0 V within ";
  cell += std::to_string(std::lround(1e3 * expectation.zero_within_s));
  return cell + " ms";
}

void record(const std::string& fault, Bench bench, const std::string& cell) {
  const std::filesystem::path records = UPRIGHT_FAULT_RECORDS;
  std::filesystem::create_directories(records);
  std::ofstream out(file_of(records, fault, static_cast<std::size_t>(bench)));
  out << cell;
  if (!out.flush()) throw std::runtime_error("cannot keep the outcome of " + fault);
}

std::string page_of(const std::filesystem::path& records) {
  std::string page =
      "# Faults and what comes of them\n\n"
      "Made by the fault suite (`ctest -L fault`) from the tests that passed; a test compares this page with "
      "what was\n"
      "seen. Each fault is put into a run that balances, and what the plant was given is looked at, not what "
      "the\n"
      "controller says of itself: the voltage that the virtual rig recorded, or the simulated plant's own "
      "input. After a\n"
      "stop the motor is at zero volts for good, the reason is in `run.yaml`, no row is missing from the "
      "log, and it\n"
      "replays. In the hundreds of milliseconds of a test a busy machine may add 50 ms to the times "
      "given.\n\n"
      "Over Modbus the runs are of `upright run` against `upright virtual-rig`, as processes of their own, "
      "at 200 Hz with\n"
      "`watchdog_s: 0.1`. A dash: not tried there, since virtual time knows nothing of the machine, a "
      "simulated plant ends\n"
      "with its program, and the Modbus register map has no bits for emergency stop and limit switches.\n\n"
      "Emergency stop and limit switches as digital lines, edges that are lost or come too fast, a GPIO chip "
      "that goes,\n"
      "and the faults of Comedi cards need a kernel with simulated chips and cards: they are put in by "
      "`scripts/test-kernel.sh`\n"
      "(`tests/kernel`), in a guest, and judged by the plant's record as well.\n\n"
      "| fault | simulated, virtual time | simulated, real time | modbus-tcp | modbus-rtu |\n"
      "|---|---|---|---|---|\n";
  for (const Fault& fault : faults()) {
    page += "| ";
    page += fault.words;
    for (std::size_t bench = 0; bench < benches.size(); ++bench) {
      page += " | ";
      page += text_or(file_of(records, fault.key, bench), "-");
    }
    page += " |\n";
  }
  return page;
}

}  // namespace upright::test
