#include "zero_volts.hpp"

#include <algorithm>

namespace upright {

namespace {

constexpr std::int64_t look_every_ns = 2'000'000;
constexpr std::int64_t say_first_ns = 500'000'000, say_every_ns = 1'000'000'000;

}  // namespace

StopReport stop_and_wait(Rig& rig, Clock& clock, const StopWatcher& watcher) {
  const auto requests = [&] { return watcher.end_requests ? watcher.end_requests() : 0u; };
  const unsigned asked = requests();
  const std::int64_t begun_ns = clock.now_ns();
  const auto patience_ns = static_cast<std::int64_t>(1e9 * stop_patience_s);
  std::int64_t say_ns = begun_ns + say_first_ns;
  for (;;) {
    const StopReport report = rig.stop();
    const std::int64_t now_ns = clock.now_ns();
    const std::int64_t left_ns = begun_ns + patience_ns - now_ns;
    if (report.done() || left_ns <= 0 || requests() != asked) return report;
    if (watcher.trying && now_ns >= say_ns) {
      say_ns = now_ns + say_every_ns;
      watcher.trying(report, static_cast<double>(left_ns) * 1e-9);
    }
    clock.sleep_until(now_ns + std::min(left_ns, look_every_ns));
  }
}

}  // namespace upright
