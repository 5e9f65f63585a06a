// A first mapping of a foreign file, from the names of its columns.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace upright {

/// A quantity of a measurement, and the column that seems to hold it.
struct ProposedColumn {
  std::string quantity;
  std::string column;  ///< empty: none was found
  std::string unit;    ///< by the name of the column or a row of units; empty: SI, as far as one can see
};

struct ImportProposal {
  std::filesystem::path file;
  std::vector<ProposedColumn> columns;  ///< one for each quantity
  std::vector<std::string> others;      ///< columns of the file that are not used

  /// Time, a position or an angle, and the voltage were found.
  bool is_complete() const;
};

/// Reads the names of a CSV or MATLAB file. Throws ConfigError for what is neither.
ImportProposal propose_mapping(const std::filesystem::path& file);

/// The dataset file; `folder` is where it will be. What was not found is a comment that says what to do.
std::string dataset_text(const ImportProposal& proposal, const std::filesystem::path& folder);

}  // namespace upright
