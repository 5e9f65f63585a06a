// A thread that does something again and again, for a plant beside the controller under test.
#pragma once

#include <pthread.h>
#include <sched.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <utility>

#include "upright/hal/clock.hpp"

namespace upright::test {

/// `act` gets the present time; it is not called any more once this is gone.
class PeriodicThread {
 public:
  PeriodicThread(std::int64_t period_ns, std::function<void(std::int64_t now_ns)> act)
      : period_ns_(period_ns), act_(std::move(act)), thread_([this] { serve(); }) {
    const sched_param parameters{20};  // below the controller's
    pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &parameters);
  }
  ~PeriodicThread() {
    ending_ = true;
    thread_.join();
  }
  PeriodicThread(const PeriodicThread&) = delete;
  PeriodicThread& operator=(const PeriodicThread&) = delete;

 private:
  void serve() {
    MonotonicClock clock;
    while (!ending_) {
      const std::int64_t now_ns = clock.now_ns();
      act_(now_ns);
      clock.sleep_until(now_ns + period_ns_);
    }
  }

  std::int64_t period_ns_;
  std::function<void(std::int64_t)> act_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace upright::test
