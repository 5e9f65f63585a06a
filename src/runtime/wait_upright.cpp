#include "wait_upright.hpp"

#include <algorithm>
#include <cmath>

namespace upright {

namespace {

constexpr std::int64_t pause_ns = 5'000'000;
constexpr std::int64_t show_every_ns = 200'000'000;
constexpr std::int64_t still_for_ns = 500'000'000;
constexpr std::int64_t link_patience_ns = 2'000'000'000;
constexpr double nearly_upright_rad = 0.1;
constexpr double still_within_rad = 0.03;  // a hand is not steadier

/// Since when the pendulum has been held where the loop may take over.
class Hold {
 public:
  explicit Hold(const RigFile& file)
      : max_angle_rad_(std::min(nearly_upright_rad, 0.5 * file.fall_angle_rad)),
        track_m_(file.track_limit_m) {}

  bool long_enough(const Pose& pose, std::int64_t now_ns) {
    const bool good = std::abs(pose.theta_rad) < max_angle_rad_ && std::abs(pose.cart_m) < track_m_;
    if (!good || !held_ || std::abs(pose.theta_rad - where_rad_) > still_within_rad) {
      held_ = good;
      where_rad_ = pose.theta_rad;
      since_ns_ = now_ns;
    }
    return held_ && now_ns - since_ns_ >= still_for_ns;
  }

 private:
  double max_angle_rad_, track_m_;
  double where_rad_ = 0.0;
  std::int64_t since_ns_ = 0;
  bool held_ = false;
};

}  // namespace

double wait_upright(Rig& rig, Clock& clock, const RigFile& file, const SignalFlag& signal,
                    const WaitOptions& options) {
  PoseScaler scaler(calibration_in_use(file));
  Hold hold(file);
  const std::int64_t begun_ns = clock.now_ns();
  const std::int64_t until_ns = begun_ns + static_cast<std::int64_t>(options.patience_s * 1e9);
  std::int64_t fresh_ns = begun_ns, shown_ns = begun_ns - show_every_ns;
  bool first = true;
  for (std::int64_t now_ns = begun_ns; now_ns < until_ns; now_ns = clock.now_ns()) {
    if (signal.load(std::memory_order_relaxed) != 0 || now_ns - fresh_ns > link_patience_ns) break;
    const RigReading reading = rig.read();
    if (reading.status == RigStatus::fresh) {
      fresh_ns = now_ns;
      scaler.scale(reading.cart_counts, reading.pendulum_counts);
      const Pose pose = scaler.nearest_turn();
      const bool within =
          std::abs(pose.theta_rad) < file.fall_angle_rad && std::abs(pose.cart_m) < file.track_limit_m;
      if (first && within) return 0.0;
      first = false;
      if (hold.long_enough(pose, now_ns)) break;
      if (options.show && now_ns - shown_ns >= show_every_ns) {
        shown_ns = now_ns;
        options.show({pose, reading.cart_counts, reading.pendulum_counts,
                      static_cast<double>(until_ns - now_ns) / 1e9});
      }
    }
    clock.sleep_until(now_ns + pause_ns);
  }
  return static_cast<double>(clock.now_ns() - begun_ns) / 1e9;
}

}  // namespace upright
