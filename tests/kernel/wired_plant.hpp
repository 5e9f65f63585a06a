// A rig as physics behind its wires; held until the first voltage.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "../../hal/virtual/virtual_plant.hpp"
#include "../integration/virtual_rig_process.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/plant_file.hpp"
#include "wires.hpp"

namespace upright::test {

class WiredPlant {
 public:
  WiredPlant(Wires& wires, const std::string& rig_text, const Pose& start, const std::filesystem::path& trace)
      : wires_(wires),
        trace_(trace),
        plant_(std::in_place, read_rig(YamlMap::from_text(rig_text, "rig.yaml")),
               read_plant_file(UPRIGHT_SOURCE_DIR "/config/plants/exponential.yaml"), options(start, trace)) {
  }

  /// What the wires say goes to the plant, and what the plant does to the wires.
  void step(std::int64_t now_ns) {
    constexpr double for_ever_s = 1e3;
    plant_->advance_to(now_ns);
    const double voltage_v = wires_.motor_v(now_ns);
    if (voltage_v != 0.0) plant_->let_go();
    plant_->feed(for_ever_s);
    plant_->command(voltage_v);
    plant_->trace(false);
    wires_.show(plant_->counts());
    if (mishap_ == Mishap::none) return;
    wires_.suffer(mishap_);
    mishap_ = Mishap::none;
  }

  bool held() const { return plant_->held(); }

  /// From another thread than `step`; returns when it has happened.
  void suffer(Mishap mishap) {
    mishap_ = mishap;
    while (mishap_ != Mishap::none) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  /// The plant's record; it ends with this.
  std::vector<TraceRow> record() {
    plant_.reset();
    return read_trace(trace_);
  }

 private:
  static VirtualRigOptions options(const Pose& start, const std::filesystem::path& trace) {
    VirtualRigOptions options;
    options.cart0_m = start.cart_m;
    options.theta0_rad = start.theta_rad;
    options.trace = trace;
    return options;
  }

  Wires& wires_;
  std::filesystem::path trace_;
  std::optional<VirtualPlant> plant_;
  std::atomic<Mishap> mishap_{Mishap::none};
};

}  // namespace upright::test
