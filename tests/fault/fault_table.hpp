// The faults of the suite, and the page docs/faults.md that it makes of what it has seen.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace upright::test {

enum class Bench { simulated_fast, simulated_real_time, modbus_tcp, modbus_rtu };

/// A row of the table.
struct Fault {
  const char* key;
  const char* words;
};

const std::vector<Fault>& faults();

/// What has to come of a fault.
struct Expectation {
  bool may_go_on = false;
  std::vector<std::string> reasons;  ///< the stops that are right; empty: none
  double zero_within_s = 0.0;        ///< zero volts at the plant, from the fault on
};

/// A cell of the table: "goes on", "`link_lost`, 0 V within 100 ms", ...
std::string cell_of(const Expectation& expectation);

/// Keeps the cell of a test that passed, under the folder UPRIGHT_FAULT_RECORDS.
void record(const std::string& fault, Bench bench, const std::string& cell);

/// The page, from the cells that were kept. Cells of tests that did not run say so.
std::string page_of(const std::filesystem::path& records);

}  // namespace upright::test
