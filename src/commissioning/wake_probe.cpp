#include "wake_probe.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <thread>
#include <vector>

#include "runtime/cpu_latency.hpp"
#include "runtime/sleep_policy.hpp"
#include "upright/hal/clock.hpp"

namespace upright {

namespace {

/// Keeps every processor busy while it lives.
class Load {
 public:
  explicit Load(unsigned threads) {
    threads_.reserve(threads);
    for (unsigned i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
  }
  ~Load() {
    ended_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;

 private:
  void work() const {
    constexpr std::size_t beyond_the_caches = 8 << 20;
    std::vector<char> from(beyond_the_caches, 1), to(beyond_the_caches);
    while (!ended_.load(std::memory_order_relaxed)) {
      std::memcpy(to.data(), from.data(), from.size());
      from.swap(to);
      for (int i = 0; i < 100; ++i) (void)::getppid();
    }
  }

  std::atomic<bool> ended_{false};
  std::vector<std::thread> threads_;
};

void sleep_and_note(double rate_hz, double duration_s, std::int64_t spin_ns, DurationHistogram& late) {
  MonotonicClock clock;
  constexpr int untimed_periods = 10;  // the first ones bring code and stack in
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / rate_hz));
  LoopPhase phase{clock.now_ns() + untimed_periods * period_ns, period_ns, 0};
  const auto periods = static_cast<std::uint64_t>(std::max(1.0, duration_s * rate_hz));
  while (phase.next_tick < periods) {
    const std::int64_t woke_ns =
        wait_until_due(clock, phase.due_ns(phase.next_tick), spin_ns, [] { return false; });
    if (woke_ns >= phase.due_ns(phase.next_tick)) late.add(wake_at(phase, woke_ns).late_ns);
  }
}

}  // namespace

WakeProbe probe_wake_ups(double rate_hz, double duration_s, bool loaded, const RealtimeRequest& request) {
  WakeProbe probe;
  const CpuLatencyHold hold;
  const Load load(loaded ? std::max(1u, std::thread::hardware_concurrency()) : 0);
  std::thread thread([&] {
    probe.grant = enter_realtime(request);
    sleep_and_note(rate_hz, duration_s, std::llround(1e3 * request.spin_us.value_or(0.0)), probe.late);
  });
  thread.join();
  return probe;
}

Finding judge_wake_ups(const std::string& subject, const DurationHistogram& late, double period_s) {
  constexpr double good_share = 0.1, bad_share = 0.5;
  const double period_us = 1e6 * period_s, p999_us = late.quantile_us(0.999);
  char what[160];
  std::snprintf(what, sizeof what,
                "latency %.0f us (50 %%), %.0f us (99.9 %%), %.0f us (max), period %.0f us",
                late.quantile_us(0.5), p999_us, late.max_us(), period_us);
  if (p999_us <= good_share * period_us) return {subject, Health::good, what, ""};
  return {subject, p999_us > bad_share * period_us ? Health::bad : Health::poor, what,
          "lower sample_rate_hz, or apply the remedies above: kernel, processors, governor, scheduling"};
}

}  // namespace upright
