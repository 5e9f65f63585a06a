// How the quadrature counters of each driver are set up: they differ, and a counter that was not set up reads
// as a number all the same.
#pragma once

#include <comedilib.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>

namespace upright {

/// One instruction to a counter's subdevice.
struct CounterStep {
  enum class Line : std::uint8_t { none, a, b };

  unsigned int instruction = INSN_CONFIG;  ///< or INSN_WRITE
  unsigned int channel = 0;
  std::array<lsampl_t, 3> data{};
  unsigned int length = 1;  ///< of data
  /// The last datum is the encoder's line of the rig file.
  Line line = Line::none;
  /// The driver may refuse it and have done it all the same, or have nothing to do.
  bool may_be_refused = false;
};

struct CounterSetup {
  const char* driver;  ///< as comedi_get_driver_name gives it
  std::int64_t zero;   ///< the reading of a counter that has counted nothing
  bool begins_anew;    ///< the steps clear the counter
  bool has_lines;      ///< A and B are chosen in the rig file
  bool one_channel;    ///< the counter is channel 0, further channels are its load registers
  std::span<const CounterStep> steps;
};

/// Null for a driver that is not in the table.
const CounterSetup* counter_setup(const std::string& driver) noexcept;

/// "multiq3, s626, ..."
std::string known_counter_drivers();

}  // namespace upright
