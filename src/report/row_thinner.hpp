// Thins the rows of a run to what a plot can show, in constant memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "upright/record/log_record.hpp"

namespace upright {

/// Keeps all rows of a run of up to `max_rows`. In longer runs it keeps some rows of each block: the first,
/// the last, and for each drawn quantity the minimum, the maximum and one that is not a number, so no peak
/// and no gap is lost. Blocks grow with the run.
class RowThinner {
 public:
  static constexpr std::size_t max_rows = 200'000;

  void add(const LogRecord& row);
  /// In their order.
  std::vector<LogRecord> take();

 private:
  struct Kept {
    std::uint64_t place;  // among all rows
    LogRecord row;
  };

  void thin(std::size_t from);
  std::vector<std::size_t> chosen(std::size_t begin, std::size_t end) const;

  std::vector<Kept> kept_;
  std::size_t block_begin_ = 0;  // place in kept_ of the block that grows
  std::uint64_t rows_ = 0, block_rows_ = 1;
};

}  // namespace upright
