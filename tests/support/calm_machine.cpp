// Runs a test that needs real time, again when it fails while the machine stood still, as virtual machines
// do:
//   calm_machine SECONDS PROGRAM [ARGUMENTS...]
// A thread of the highest priority on each processor, woken every millisecond, is the witness. Ends with the
// program's exit code; with 77 (skipped) when every attempt within so many seconds failed and the machine
// stood still in each, for then the test says nothing about the program.
#include <pthread.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

constexpr int skipped = 77;
constexpr auto calm = std::chrono::seconds(1);

/// Tells a machine that stands still from one that is busy: an operating system alone, however busy, makes
/// nobody of the highest priority wait for several periods of the loops under test, in one go or, as where a
/// host deals out its time in slices, in many that follow each other.
class Lateness {
 public:
  static constexpr auto standstill = std::chrono::milliseconds(10);

  /// Takes what passed since the last wake and by how much this one was late; whether the machine begins to
  /// stand still.
  bool begins_standstill(Clock::duration passed, Clock::duration late) {
    lost_ -= std::min(lost_, passed / share_allowed);
    if (late > unavoidable) lost_ += late;
    const bool stood = stands_;
    stands_ = lost_ > standstill;
    return stands_ && !stood;
  }

 private:
  static constexpr auto unavoidable = std::chrono::milliseconds(1);
  static constexpr int share_allowed = 10;

  Clock::duration lost_{};
  bool stands_ = false;
};

/// Watches, from its making to its end, by how much a sleeper of the highest priority is late on one
/// processor: a virtual machine's stand still one by one.
class Witness {
 public:
  explicit Witness(int processor) : thread_([this] { watch(); }) {
    cpu_set_t here;
    CPU_ZERO(&here);
    CPU_SET(processor, &here);
    pthread_setaffinity_np(thread_.native_handle(), sizeof here, &here);
    // Where the priority is not granted it watches all the same.
    const sched_param highest{sched_get_priority_max(SCHED_FIFO)};
    pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &highest);
  }
  ~Witness() { stop(); }
  Witness(const Witness&) = delete;
  Witness& operator=(const Witness&) = delete;

  void stop() {
    ends_ = true;
    if (thread_.joinable()) thread_.join();
  }
  Clock::duration latest() const { return latest_; }
  int standstills() const { return standstills_; }

 private:
  void watch() {
    Lateness lateness;
    Clock::time_point woken = Clock::now();
    while (!ends_) {
      const Clock::time_point due = woken + std::chrono::milliseconds(1);
      std::this_thread::sleep_until(due);
      const Clock::time_point now = Clock::now();
      latest_ = std::max(latest_, now - due);
      if (lateness.begins_standstill(now - woken, now - due)) ++standstills_;
      woken = now;
    }
  }

  std::atomic<bool> ends_{false};
  Clock::duration latest_{};
  int standstills_ = 0;
  std::thread thread_;
};

struct Observed {
  int standstills = 0;
  double worst_ms = 0.0;
};

/// What a witness on each processor sees while something is done.
template <class Work>
Observed observe(Work&& work) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  sched_getaffinity(0, sizeof allowed, &allowed);
  std::vector<std::unique_ptr<Witness>> witnesses;
  for (int processor = 0; processor < CPU_SETSIZE; ++processor)
    if (CPU_ISSET(processor, &allowed)) witnesses.push_back(std::make_unique<Witness>(processor));
  work();
  Observed observed;
  for (const auto& witness : witnesses) {
    witness->stop();
    observed.standstills += witness->standstills();
    const double latest_ms = std::chrono::duration<double, std::milli>(witness->latest()).count();
    observed.worst_ms = std::max(observed.worst_ms, latest_ms);
  }
  return observed;
}

void leave_word() {
  const char* file = std::getenv("UPRIGHT_INTERRUPTED");
  if (file == nullptr) return;
  std::filesystem::create_directories(std::filesystem::path(file).parent_path());
  std::ofstream(file) << "the machine stood still\n";
}

int run(char** command) {
  const pid_t child = fork();
  if (child == 0) {
    execvp(command[0], command);
    std::perror(command[0]);
    _exit(127);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child) return EXIT_FAILURE;
  return WIFEXITED(status) ? WEXITSTATUS(status) : EXIT_FAILURE;
}

/// Waits until the machine has run for a while without standing still; whether it did before the end.
bool await_calm(Clock::time_point end) {
  while (Clock::now() < end) {
    if (observe([] { std::this_thread::sleep_for(calm); }).standstills == 0) return true;
  }
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fputs("usage: calm_machine SECONDS PROGRAM [ARGUMENTS...]\n", stderr);
    return 2;
  }
  const Clock::time_point end = Clock::now() + std::chrono::seconds(std::atoi(argv[1]));
  for (int attempt = 1;; ++attempt) {
    const auto started = Clock::now();
    int status = 0;
    const Observed observed = observe([&] { status = run(argv + 2); });
    if (status == 0 || observed.standstills == 0) return status;
    std::printf("!! attempt %d failed (%d) while the machine stood still %d times, for %.1f ms at worst\n",
                attempt, status, observed.standstills, observed.worst_ms);
    const auto another = Clock::now() + (Clock::now() - started);
    if (another > end || !await_calm(end)) {
      std::printf("!! SKIPPED: this machine is not calm enough for a test in real time\n");
      leave_word();
      return skipped;
    }
    std::fflush(stdout);
  }
}
