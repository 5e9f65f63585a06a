// The voltages of a record in the order of time: one at each sample, or more in a record with fewer samples
// than commands.
#pragma once

#include <cstddef>

#include "upright/measurement/measurement.hpp"

namespace upright {

class VoltageCommands {
 public:
  /// `run` must outlive this.
  explicit VoltageCommands(const Measurement& run) : run_(run) {}

  /// The number of the first command at a sample or after it; for the number of samples, that of all
  /// commands.
  std::size_t first_of(std::size_t sample) const {
    if (run_.commands.empty()) return sample;
    return sample < run_.first_command.size() ? run_.first_command[sample] : run_.commands.size();
  }
  VoltageCommand operator[](std::size_t i) const {
    return run_.commands.empty() ? VoltageCommand{run_.time_s[i], run_.voltage_v[i]} : run_.commands[i];
  }

 private:
  const Measurement& run_;
};

}  // namespace upright
