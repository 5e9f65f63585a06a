// The plant of a virtual rig in real time: held until let go, with the watchdog that takes the voltage away.
#pragma once

#include <cstdint>
#include <fstream>

#include "hal/virtual_rig.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {

class VirtualPlant {
 public:
  VirtualPlant(const RigFile& rig, const Plant& plant, const VirtualRigOptions& options);

  void advance_to(std::int64_t time_ns);
  EncoderCounts counts() const;
  void command(double voltage_v);
  /// Rate of the counts of the cart's and of the pendulum's encoder [1/s].
  std::array<double, 2> counts_per_s() const;
  /// A valid request came: the watchdog starts anew.
  void feed(double watchdog_s);
  void let_go();
  void put_back();
  bool held() const { return held_; }
  double voltage_v() const { return voltage_v_; }
  std::int64_t fed_ns() const { return fed_ns_; }
  /// How long ago the pendulum was let go.
  double free_s() const { return held_ ? 0.0 : static_cast<double>(now_ns_ - let_go_ns_) * 1e-9; }
  /// A line of the trace, when one is due or `now`.
  void trace(bool now);

 private:
  double seconds(std::int64_t time_ns) const { return static_cast<double>(time_ns - let_go_ns_) * 1e-9; }
  void move_to(std::int64_t time_ns);
  void hold_at(double theta_rad);
  void lift();

  Calibration calibration_;
  double limit_v_;
  PlantState<double> initial_;
  Simulator<double> simulator_;
  bool held_ = true;
  double voltage_v_ = 0.0;
  std::int64_t now_ns_ = 0, let_go_ns_ = 0, fed_ns_ = 0, expires_ns_ = 0, traced_ns_ = 0, flushed_ns_ = 0;
  std::int64_t hang_ns_ = 0, hanging_since_ns_ = 0;  ///< hang_ns_ is 0 once the pendulum has been lifted
  std::ofstream trace_;
};

}  // namespace upright
