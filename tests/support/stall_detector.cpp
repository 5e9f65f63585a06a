#include "stall_detector.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <utility>

namespace upright::test {

namespace {

double now_s() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void sleep_period() {
  std::this_thread::sleep_for(std::chrono::duration<double>(LateWakes::period_s));
}

}  // namespace

std::optional<Interval> LateWakes::woke(double now_s) {
  const double before_s = std::exchange(last_wake_s_, now_s);
  const double late_s = now_s - before_s - period_s;
  if (before_s == 0.0 || late_s <= unavoidable_s) return std::nullopt;
  if (before_s - end_s_ > apart_s) {
    begin_s_ = before_s;
    lost_s_ = 0.0;
  }
  end_s_ = now_s;
  lost_s_ += late_s;
  if (lost_s_ < stall_s) return std::nullopt;
  return Interval{begin_s_, end_s_};
}

namespace {

void keep_longer(std::optional<Interval>& longest, const std::optional<Interval>& other) {
  if (!other) return;
  if (!longest || other->end_s - other->begin_s > longest->end_s - longest->begin_s) longest = other;
}

}  // namespace

/// Both ends of a pseudo-terminal.
class StallDetector::SerialLine {
 public:
  SerialLine() : near_(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    std::array<char, 128> name{};
    if (near_ < 0 || grantpt(near_) != 0 || unlockpt(near_) != 0 ||
        ptsname_r(near_, name.data(), name.size()) != 0)
      return;
    far_ = open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios settings{};
    tcgetattr(far_, &settings);
    cfmakeraw(&settings);
    tcsetattr(far_, TCSANOW, &settings);
  }
  ~SerialLine() {
    close(far_);
    close(near_);
  }
  SerialLine(const SerialLine&) = delete;
  SerialLine& operator=(const SerialLine&) = delete;

  /// False: no pseudo-terminal is available.
  bool is_there() const { return far_ >= 0; }
  /// Sends a byte from one end to the other.
  void carry() const {
    char byte = 0;
    if (write(far_, &byte, 1) == 1) static_cast<void>(!read(near_, &byte, 1));
  }

 private:
  int near_ = -1, far_ = -1;
};

/// A sleeper that is bound to one processor, or that sends a byte on a line at each wake. It allocates its
/// memory at the start, because some tests forbid allocation later.
class StallDetector::Watcher {
 public:
  explicit Watcher(std::unique_ptr<SerialLine> line)
      : stalls_(max_stalls), line_(std::move(line)), thread_([this] { watch(); }) {}
  explicit Watcher(int processor) : Watcher(std::unique_ptr<SerialLine>()) {
    cpu_set_t here;
    CPU_ZERO(&here);
    CPU_SET(processor, &here);
    pthread_setaffinity_np(thread_.native_handle(), sizeof here, &here);
  }
  ~Watcher() {
    ends_ = true;
    thread_.join();
  }
  Watcher(const Watcher&) = delete;
  Watcher& operator=(const Watcher&) = delete;

  /// Whether all stalls until `time_s` are known.
  bool has_seen(double time_s) const { return seen_s_ >= time_s; }

  std::optional<Interval> stall_in(const Interval& when) const {
    std::optional<Interval> longest;
    for (std::size_t i = 0; i < count_; ++i) {
      const Interval stall{stalls_[i].begin_s, stalls_[i].end_s};
      if (stall.overlaps(when)) keep_longer(longest, stall);
    }
    return longest;
  }

 private:
  struct Stall {
    double begin_s = 0.0;
    std::atomic<double> end_s{0.0};
  };
  /// Enough for 5 minutes of the shortest and most frequent stalls.
  static constexpr std::size_t max_stalls = 20'000;

  void watch() {
    LateWakes wakes;
    while (!ends_) {
      const double woken_s = now_s();
      if (const std::optional<Interval> stall = wakes.woke(woken_s)) keep(*stall);
      seen_s_ = woken_s;
      sleep_period();
      if (line_) line_->carry();
    }
  }

  void keep(const Interval& stall) {
    const std::size_t count = count_;
    if (count > 0 && stalls_[count - 1].begin_s == stall.begin_s) {
      stalls_[count - 1].end_s = stall.end_s;
    } else if (count < max_stalls) {
      stalls_[count].begin_s = stall.begin_s;
      stalls_[count].end_s = stall.end_s;
      count_ = count + 1;
    }
  }

  std::vector<Stall> stalls_;
  std::atomic<std::size_t> count_{0};
  std::atomic<double> seen_s_{-1.0};
  std::atomic<bool> ends_{false};
  std::unique_ptr<SerialLine> line_;
  std::thread thread_;
};

StallDetector::StallDetector() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  sched_getaffinity(0, sizeof allowed, &allowed);
  for (int processor = 0; processor < CPU_SETSIZE; ++processor)
    if (CPU_ISSET(processor, &allowed)) watchers_.push_back(std::make_unique<Watcher>(processor));
  if (auto line = std::make_unique<SerialLine>(); line->is_there())
    watchers_.push_back(std::make_unique<Watcher>(std::move(line)));
  // A stall is detected only after a first wake.
  for (const auto& watcher : watchers_)
    while (!watcher->has_seen(0.0)) sleep_period();
}

StallDetector::~StallDetector() = default;

std::optional<Interval> StallDetector::stall_in(const Interval& when) const {
  const double asked_s = now_s();
  std::optional<Interval> longest;
  for (const auto& watcher : watchers_) {
    while (!watcher->has_seen(asked_s)) sleep_period();
    keep_longer(longest, watcher->stall_in(when));
  }
  return longest;
}

}  // namespace upright::test
