// Which of the data are held out: whole runs, or segments of a single one.
#pragma once

#include <vector>

#include "upright/analysis/fit.hpp"

namespace upright {

/// The data in two parts, by run and never by sample.
struct DataSplit {
  FitData train, held;
  std::vector<std::size_t> held_out_runs;  ///< none of a single run, a third of whose segments is held out
};

/// Holds out a third, alike in liveliness to the rest.
DataSplit split(const std::vector<Measurement>& runs);

}  // namespace upright
