#include "shim.hpp"

#include <fcntl.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <sstream>
#include <string>
#include <string_view>

namespace upright::test {

namespace {

struct Plan {
  std::atomic<Disturbance> kind{Disturbance::none};
  std::atomic<double> begins_s{0.0}, amount{0.0};
  std::atomic<double> struck_s{0.0};
};

Plan plan;

double now_s() {
  timespec now{};
  syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

bool is_due() {
  return plan.kind.load() != Disturbance::none && now_s() >= plan.begins_s.load();
}

void strike() {
  double never = 0.0;
  const double now = now_s();
  if (!plan.struck_s.compare_exchange_strong(never, now)) return;
  const char* mark = std::getenv("UPRIGHT_SHIM_MARK");
  if (mark == nullptr) return;
  const int descriptor = ::open(mark, O_CREAT | O_WRONLY | O_CLOEXEC, 0644);
  if (descriptor < 0) return;
  const std::string text = std::to_string(now);
  syscall(SYS_write, descriptor, text.data(), text.size());
  ::close(descriptor);
}

bool is_samples(int descriptor) {
  std::array<char, 512> path{};
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  const ssize_t size = ::readlink(link.c_str(), path.data(), path.size());
  return size > 0 && std::string_view(path.data(), static_cast<std::size_t>(size)).ends_with("samples.csv");
}

void pause(double seconds) {
  timespec left{static_cast<time_t>(seconds),
                static_cast<long>(1e9 * (seconds - static_cast<double>(static_cast<time_t>(seconds))))};
  while (nanosleep(&left, &left) != 0) {
  }
}

void before_disk(int descriptor) {
  const Disturbance kind = plan.kind.load();
  if (kind == Disturbance::none || kind == Disturbance::step_clock || !is_due() || !is_samples(descriptor))
    return;
  const bool first = plan.struck_s.load() == 0.0;
  strike();
  if (kind == Disturbance::slow_writes || (kind == Disturbance::one_slow_write && first))
    pause(plan.amount.load());
  if (kind == Disturbance::kill_writer && first) syscall(SYS_exit, 0);
}

bool clock_is_stepped() {
  if (plan.kind.load() != Disturbance::step_clock || !is_due()) return false;
  strike();
  return true;
}

/// The variable of a preloaded library.
struct FromEnvironment {
  FromEnvironment() {
    const char* words = std::getenv("UPRIGHT_SHIM");
    if (words == nullptr) return;
    std::istringstream in(words);
    int kind = 0;
    double after_s = 0.0, amount = 0.0;
    in >> kind >> after_s >> amount;
    disturb(static_cast<Disturbance>(kind), after_s, amount);
  }
};

const FromEnvironment from_environment;

}  // namespace

void disturb(Disturbance kind, double after_s, double amount) {
  plan.kind = Disturbance::none;
  plan.struck_s = 0.0;
  plan.amount = amount;
  plan.begins_s = now_s() + after_s;
  plan.kind = kind;
}

double struck_s() {
  return plan.struck_s.load();
}

}  // namespace upright::test

extern "C" {

ssize_t write(int descriptor, const void* bytes, size_t size) {
  upright::test::before_disk(descriptor);
  return syscall(SYS_write, descriptor, bytes, size);
}

int fdatasync(int descriptor) {
  if (upright::test::plan.kind.load() == upright::test::Disturbance::slow_writes)
    upright::test::before_disk(descriptor);
  return static_cast<int>(syscall(SYS_fdatasync, descriptor));
}

int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const auto status = static_cast<int>(syscall(SYS_clock_gettime, clock, now));
  if (upright::test::clock_is_stepped() && clock == CLOCK_REALTIME)
    now->tv_sec += static_cast<time_t>(upright::test::plan.amount.load());
  return status;
}

time_t time(time_t* where) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (where != nullptr) *where = now.tv_sec;
  return now.tv_sec;
}
}
