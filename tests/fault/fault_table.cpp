#include "fault_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace upright::test {

namespace {

constexpr std::array names = {"simulated-fast", "simulated-real-time", "modbus-tcp", "modbus-rtu", "gpio",
                              "comedi",         "quanser-hil",         "board"};

using Cells = std::array<std::string, names.size()>;

constexpr const char* no_test = "-";
constexpr const char* between_cells = " | ";

constexpr const char* introduction =
    R"(# Faults and what happens then

This page is for users who want to know how upright reacts when something fails. Find the fault in the first column and your backend in
the first row. The fault suite writes the table from the tests that passed: `scripts/test-kernel.sh` for gpio and comedi,
`ctest -L fault` for the other columns. Each of them compares its columns with what it observed.

- *goes on*: the run continues.
- *`reason`, 0 V within T*: the run stops with this reason, and the motor is at zero volts within the time T.
- A dash means not applicable ([why](#when-a-dash-is-in-a-cell)).

After each stop the motor stays at zero volts, the reason is in `run.yaml`, no row is missing from the log, and the log
replays. A busy machine may add 50 ms to the times in the hundreds of milliseconds.

## How the faults are tested

Each fault occurs during a run that balances. The verdict comes from the plant and not from the controller: the voltage that the
virtual rig recorded, the input of the simulated plant, the output of the card, or the pins of the board.

- **Simulated.** `upright run` on the simulated rig, in virtual time and in real time.
- **modbus-tcp, modbus-rtu.** `upright run` against `upright virtual-rig`, as separate processes, at 200 Hz with `watchdog_s: 0.1`.
- **At the stop.** In the rows that begin with "at the stop", the device is driven, then it misbehaves, and then the rig is stopped. The
  verdict comes from the device's own record of the voltages that it accepted (`tests/integration/fake_device.cpp`, a device that
  shares no code with the link of the program). The device has no watchdog unless the row says so. If it misbehaves permanently,
  Ctrl-C is pressed once more; otherwise the program gives up after 10 s.
- **gpio, comedi.** `upright run` at 200 Hz in a virtual machine with Debian's kernel, whose simulated chip and cards are moved by a plant
  (`tests/kernel`). comedi uses cards only: two potentiometers (counters where they wrap) and the output. gpio has the pendulum encoder,
  emergency stop, limit switches, amplifier enable and heartbeat on lines, and a watchdog that switches the motor off when the
  heartbeat has stopped for 100 ms. Its cart encoder and output are on cards, since a cart makes more edges than lines can count.
- **quanser-hil.** `upright run` at 200 Hz with a test version of `libhil.so` (`tests/fault/fake_hil`). Its card is a separate process
  with 16-bit counters, an enable line, and a watchdog of 0.1 s that locks the card when it expires. The verdict comes from the card's
  record of its output. No real Quanser card has been tested. HIL cannot read outputs back: zero volts is confirmed when the card or
  its watchdog has set it.
- **board.** `upright run` at 200 Hz over `config/rigs/board.yaml` against a board with the firmware of this repository
  ([build-a-board.md](../how-to/build-a-board.md)), executed instruction by instruction in an emulator. The plant turns the encoder
  lines and reads the voltage from the PWM, direction and enable pins.

## How fast a stuck encoder is found

A stuck encoder is found when something must have moved and the encoder does not show it. If the plant is known, or the rig file has
`encoder_watch` ([rig files](rig-files.md#encoder-watch)), this took 0.15 to 0.26 s in the median for the cart (longest of 720: 1.56 s)
and 0.12 s for the pendulum (2.27 s), on both shipped plants at 200, 500 and 1000 Hz. Without either, the watch allows for every usual
cart: a stuck cart encoder took 1.8 s in the median, and 8 of 360 were not found before the end of the 10 s run.

## When a dash is in a cell

- Virtual time does not depend on the machine, and a simulated plant ends with its program.
- The registers of the virtual rig have no bits for emergency stop and limit switches. Cards alone have no lines.
- Lines and cards answer a call or refuse it. So no reply is late, lost, corrupt or out of order, and no device restarts.
- Edges are counted by the program, which does not wrap, or by the board in 32 bits. The lines of a board cannot jump.
- Only an analog input is a potentiometer.
- Only a card with its own library must be opened, and only such a card has a watchdog that locks it or can be the clock.
- Requests are disturbed, and the program of a device hangs, on the board only. A reply that arrives twice or out of order and the
  behaviour at the stop are not tested again on the board: its link is that of modbus-rtu.

One fault is not in the table, because the suite reads the folder that the fault removes. If another program removes the folder of a
run, the run ends with `log_failed`, 0 V within 250 ms and exit code 3 (test `RemovedRun`).

## The table

| fault | simulated, virtual time | simulated, real time | modbus-tcp | modbus-rtu | gpio | comedi | quanser-hil | board |
|---|---|---|---|---|---|---|---|---|
)";

std::filesystem::path file_of(const std::filesystem::path& records, const std::string& fault,
                              std::size_t bench) {
  return records / (fault + "." + names.at(bench));
}

/// Beside a record, or instead of it: a test of that cell was skipped.
std::filesystem::path skip_of(const std::filesystem::path& record) {
  return record.string() + ".skipped";
}

std::string text_or(const std::filesystem::path& file, const std::string& otherwise) {
  std::ifstream in(file);
  if (!in) return otherwise;
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// The cells of a fault's row in `page`.
Cells cells_in(const std::string& page, const Fault& fault) {
  Cells cells;
  cells.fill(no_test);
  const std::string start = std::string("\n| ") + fault.words + between_cells;
  std::size_t from = page.find(start);
  if (from == std::string::npos) return cells;
  from += start.size();
  const std::string row = page.substr(from, page.find('\n', from) - from);
  std::size_t begin = 0;
  for (std::string& cell : cells) {
    const std::size_t end = row.find(" |", begin);
    if (end == std::string::npos) break;
    cell = row.substr(begin, end - begin);
    begin = end + std::string(between_cells).size();
  }
  return cells;
}

}  // namespace

std::optional<Bench> bench_named(const std::string& name) {
  const auto* const found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<Bench>(found - names.begin());
}

Expectation goes_on() {
  return {true, {}, 0.0};
}

Expectation stops(std::vector<std::string> reasons, double within_s) {
  return {false, std::move(reasons), within_s};
}

const std::vector<Fault>& faults() {
  static const std::vector<Fault> list = {
      {"missed_cycles", "the controller stalls for 12 ms"},
      {"overrun", "the controller stalls for 250 ms"},
      {"stuck_cart", "the cart encoder stops counting"},
      {"stuck_pendulum", "the pendulum encoder stops counting"},
      {"jump", "the cart's counts jump by 5000 and stay there"},
      {"no_contact", "a potentiometer has no contact"},
      {"wrap", "16-bit counters wrap during the motion"},
      {"sign_amplifier", "`amplifier.sign` is wrong"},
      {"sign_cart", "`calibration.cart.sign` is wrong"},
      {"sign_pendulum", "`calibration.pendulum.sign` is wrong"},
      {"nan", "the controller computes a value that is not a number"},
      {"late", "one reply in 20 is late"},
      {"drop", "one reply in 20 is lost"},
      {"corrupt", "one reply in 20 has a wrong bit"},
      {"corrupt_request", "one request in 20 has a wrong bit"},
      {"noise", "noise precedes one request in 20 and follows one reply in 20"},
      {"stale", "one reply in 20 repeats the previous one"},
      {"reorder", "one reply in 20 is sent after the next one"},
      {"silent", "the replies stop"},
      {"always_late", "every reply comes too late"},
      {"cut", "the link is cut, or the encoders' card is removed"},
      {"restart", "the device restarts"},
      {"device_hangs", "the device's program hangs"},
      {"emergency_stop", "the emergency stop is pressed"},
      {"limit_switch", "a limit switch is hit"},
      {"line_failed", "a digital line can no longer be read"},
      {"edges_lost", "encoder edges are lost"},
      {"edges_too_fast", "encoder edges come faster than `fastest_edges_per_s`"},
      {"disk_full", "the disk is full"},
      {"slow_disk", "each write and sync of the log takes 0.3 s"},
      {"dead_disk", "one write of the log takes 3 s"},
      {"writer_killed", "the log's writer thread is killed"},
      {"card_refuses", "the card refuses voltages"},
      {"card_expires", "the card's watchdog expires although it was reset in time"},
      {"card_opens_late", "the first two attempts to open the card fail"},
      {"card_was_locked", "the card was locked by an expired watchdog before the run"},
      {"clock_drifts", "the card is the clock, and its clock is slow by 500 ppm"},
      {"clock_samples_lost", "the card is the clock, and one sample in 20 is lost"},
      {"clock_stops", "the card is the clock, and takes no samples any more"},
      {"sigterm", "SIGTERM"},
      {"sigkill", "SIGKILL"},
      {"stop_busy", "at the stop the device is busy (exception 06) for 1 s"},
      {"stop_refused_connections", "at the stop the device refuses connections, or does not reply, for 1 s"},
      {"stop_resets",
       "at the stop the device resets connections, or answers "
       "with noise, for 1 s"},
      {"stop_wrong_replies", "at the stop the replies come from another unit for 1 s"},
      {"stop_ignored", "at the stop the device acknowledges zero volts and ignores it for 1 s"},
      {"stop_refused_function", "at the stop the device refuses function 0x17"},
      {"stop_ignored_for_good", "at the stop the device acknowledges zero volts and ignores it permanently"},
      {"stop_silent_watchdog", "at the stop the device stops replying permanently and has its own watchdog"},
      {"clock_step", "the wall clock steps by an hour"},
      {"memory", "no more memory can be allocated"},
      {"two_controllers", "a second controller is started on the same machine (it is refused)"},
      {"rig_file_changed", "the rig file is overwritten during the run"},
  };
  return list;
}

std::string cell_of(const Expectation& expectation) {
  std::string cell = expectation.is_within_bound ? "goes on" : "";
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

void record_skipped(const std::string& fault, Bench bench) {
  const std::filesystem::path records = UPRIGHT_FAULT_RECORDS;
  std::filesystem::create_directories(records);
  std::ofstream(skip_of(file_of(records, fault, static_cast<std::size_t>(bench)))) << "skipped";
}

std::string page_of(const std::filesystem::path& records, const std::string& page,
                    const std::vector<Bench>& benches) {
  std::string made = introduction;
  for (const Fault& fault : faults()) {
    Cells cells = cells_in(page, fault);
    for (const Bench bench : benches) {
      const auto column = static_cast<std::size_t>(bench);
      const std::filesystem::path kept = file_of(records, fault.key, column);
      if (!std::filesystem::exists(kept) && std::filesystem::exists(skip_of(kept))) continue;
      cells.at(column) = text_or(kept, no_test);
    }
    made += std::string("| ") + fault.words;
    for (const std::string& cell : cells) made += between_cells + cell;
    made += " |\n";
  }
  return made;
}

}  // namespace upright::test
