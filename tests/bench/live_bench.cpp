// How late the loop wakes without the live page, and with it open in some pages: runs in real time on the
// simulated rig, one without and one with the page in turn, so that what else the machine does falls on both
// alike.
//   build/release/tests/bench/live_bench [SECONDS per run (20)] [PAIRS (3)] [PAGES (2)]
#include <httplib.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "live/live_view.hpp"
#include "runtime/realtime.hpp"
#include "upright/hal/simulated_rig.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/runtime/session.hpp"

namespace upright {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

const fs::path config = fs::path(UPRIGHT_SOURCE_DIR) / "config";

struct Setting {
  double run_s = 20.0;
  int pairs = 3;
  int pages = 2;
};

RunSetup setup_for(const Setting& setting) {
  RunSetup setup;
  setup.command = "live_bench";
  setup.label = "live-bench";
  setup.duration_s = setting.run_s;
  setup.rig = read_rig_file(config / "rigs" / "simulated.yaml");
  setup.control = read_gain_file(config / "gains" / "exponential.yaml");
  setup.plant = read_plant_file(setup.rig.simulated->plant);
  setup.limits.periods = static_cast<std::uint64_t>(setting.run_s * setup.control.sample_rate_hz);
  setup.limits.track_limit_m = setup.rig.track_limit_m;
  setup.limits.fall_angle_rad = setup.rig.fall_angle_rad;
  setup.limits.watchdog_s = setup.rig.watchdog_s;
  setup.limits.max_periods_late = default_periods_late(setup.control.period_s());
  return setup;
}

/// Pages that are open, as a browser holds them.
class Pages {
 public:
  Pages(int port, int count) {
    for (int i = 0; i < count; ++i)
      readers_.emplace_back([this, port] {
        make_way(loop_cpu({}));
        httplib::Client client("127.0.0.1", port);
        client.set_read_timeout(5s);
        client.Get("/events", [this](const char*, std::size_t size) {
          bytes_ += size;
          return true;
        });
      });
  }
  ~Pages() {
    for (std::thread& reader : readers_) reader.join();
  }
  Pages(const Pages&) = delete;
  Pages& operator=(const Pages&) = delete;
  std::size_t bytes() const { return bytes_; }

 private:
  std::atomic<std::size_t> bytes_{0};
  std::vector<std::thread> readers_;
};

SessionResult run_once(const Setting& setting, const fs::path& out, bool with_page) {
  RunSetup setup = setup_for(setting);
  MonotonicClock clock;
  const auto rig = make_simulated_rig(setup.rig, clock, {1, {}});
  rig->open();
  const SignalFlag no_signal{0};
  SessionOptions options;
  options.out = out;
  std::unique_ptr<LiveView> view;
  std::unique_ptr<Pages> pages;
  if (with_page) {
    LiveScene scene;
    scene.period_s = setup.control.period_s();
    view = std::make_unique<LiveView>(scene, LiveOptions{0, loop_cpu({}), [] {}});
    const std::string url = view->url();
    pages = std::make_unique<Pages>(std::stoi(url.substr(url.rfind(':') + 1)), setting.pages);
    options.watcher = view.get();
  }
  SessionResult result = run_session(std::move(setup), *rig, clock, no_signal, std::move(options));
  if (view) {
    view->end({LiveState::Kind::completed, "over"});
    std::printf("  (%.0f kB sent per page)\n", 1e-3 * static_cast<double>(pages->bytes()) / setting.pages);
  }
  return result;
}

void print(const char* name, const LoopOutcome& o) {
  std::printf(
      "%-10s woke late: p50 %6.1f us  p99 %6.1f us  p99.9 %6.1f us  worst %7.1f us   cycle p99.9 %6.1f us   "
      "missed %llu\n",
      name, o.wake_late.quantile_us(0.5), o.wake_late.quantile_us(0.99), o.wake_late.quantile_us(0.999),
      o.wake_late.max_us(), o.cycle.quantile_us(0.999), static_cast<unsigned long long>(o.counts.missed));
  std::fflush(stdout);
}

void compare(const Setting& setting) {
  const fs::path out = fs::temp_directory_path() / "upright-live-bench";
  for (int pair = 0; pair < setting.pairs; ++pair)
    for (const bool with_page : {false, true}) {
      const SessionResult result = run_once(setting, out, with_page);
      if (pair == 0 && !with_page) std::printf("%s\n", result.scheduling.note.c_str());
      print(with_page ? "with" : "without", result.outcome);
    }
  fs::remove_all(out);
}

}  // namespace
}  // namespace upright

int main(int argc, char** argv) {
  upright::Setting setting;
  if (argc > 1) setting.run_s = std::atof(argv[1]);
  if (argc > 2) setting.pairs = std::atoi(argv[2]);
  if (argc > 3) setting.pages = std::atoi(argv[3]);
  if (!(setting.run_s > 0.0) || setting.pairs < 1 || setting.pages < 1) {
    std::fprintf(stderr, "usage: live_bench [SECONDS per run] [PAIRS] [PAGES]\n");
    return 2;
  }
  upright::compare(setting);
}
