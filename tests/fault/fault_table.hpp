// The faults of the suite, and the page docs/reference/faults.md that it makes of what it has seen.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace upright::test {

enum class Bench {
  simulated_fast,
  simulated_real_time,
  modbus_tcp,
  modbus_rtu,
  gpio,
  comedi,
  quanser_hil,
  board
};

/// The name of a bench's records: "modbus-tcp", ...; none: there is no such bench.
std::optional<Bench> bench_named(const std::string& name);

/// A row of the table.
struct Fault {
  const char* key;
  const char* words;
};

const std::vector<Fault>& faults();

/// What has to come of a fault.
struct Expectation {
  bool is_within_bound = false;
  std::vector<std::string> reasons;  ///< the stops that are right; empty: none
  double zero_within_s = 0.0;        ///< zero volts at the plant, from the fault on
};

/// How long an encoder that sticks may go unnoticed: until something has moved that it does not show. Of 60
/// random moments in 5 s of balancing with the gain (7) at 200, 500 and 1000 Hz each, half were noticed
/// within 0.14 s, the latest after 0.77 s (cart) and 2.24 s, when a pendulum at rest within a count had
/// fallen.
inline constexpr double stuck_noticed_s = 2.5;

/// At 200 Hz two or three periods are missed then, wherever in its cycle it begins; a run goes on after
/// three. With 18 ms it could be four.
inline constexpr double short_standstill_s = 0.012;

Expectation goes_on();
Expectation stops(std::vector<std::string> reasons, double within_s);

/// A cell of the table: "goes on", "`link_lost`, 0 V within 100 ms", ...
std::string cell_of(const Expectation& expectation);

/// Keeps the cell of a test that passed, under the folder UPRIGHT_FAULT_RECORDS.
void record(const std::string& fault, Bench bench, const std::string& cell);
/// That the machine kept a test from judging: the page's cell stays as it is.
void record_skipped(const std::string& fault, Bench bench);

/// The page with the cells of `benches` from what was kept, and those of the others as in `page`, for no
/// machine runs them all at once. A dash is a cell that no test has.
std::string page_of(const std::filesystem::path& records, const std::string& page,
                    const std::vector<Bench>& benches);

}  // namespace upright::test
