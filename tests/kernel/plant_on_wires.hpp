// A rig as physics behind its wires, in real time.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "periodic_thread.hpp"
#include "upright/hal/clock.hpp"
#include "wired_plant.hpp"

namespace upright::test {

class PlantOnWires {
 public:
  static constexpr std::int64_t period_ns = 2'000'000;  // an emulated processor has enough to do

  PlantOnWires(Wires& wires, const std::string& rig_text, const Pose& start,
               const std::filesystem::path& trace)
      : plant_(wires, rig_text, start, trace) {
    plant_.step(MonotonicClock().now_ns());
    thread_.emplace(period_ns, [this](std::int64_t now_ns) { plant_.step(now_ns); });
  }

  /// Returns when it has happened.
  void suffer(Mishap mishap) { plant_.suffer(mishap); }
  /// The plant's record; it ends with this.
  std::vector<TraceRow> record() {
    thread_.reset();
    return plant_.record();
  }

 private:
  WiredPlant plant_;
  std::optional<PeriodicThread> thread_;  // gone before what it moves
};

}  // namespace upright::test
