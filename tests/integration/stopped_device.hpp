// A device that is driven, gets into trouble, and is stopped; and what its own record says of that.
#pragma once

#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include "fake_device.hpp"
#include "runtime/zero_volts.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/rig_factory.hpp"
#include "virtual_rig_process.hpp"

namespace upright::test {

inline constexpr double loop_period_s = 0.05, run_v = 2.2;

struct StopCase {
  bool serial = false;
  bool has_watchdog = false;
  Trouble trouble = Trouble::none;
  double for_s = 0.0;
  bool reads_back = true;

  std::string name() const {
    return std::string(serial ? "rtu" : "tcp") + (has_watchdog ? " with watchdog" : "") + ", trouble " +
           std::to_string(static_cast<int>(trouble)) + " for " + std::to_string(for_s) + " s";
  }
};

/// A device, and a rig that drives it.
struct Driven {
  explicit Driven(const StopCase& c) : device({c.serial, c.has_watchdog, c.reads_back, false}) {
    const std::filesystem::path file = folder / "rig.yaml";
    // The machine may be busy: what is tested here is what is done, not how fast.
    std::ofstream(file) << device.rig_text(0.03);
    open(file);
    drive();
  }
  /// Opening is not tested here: a busy machine may let the device answer later than the rig waits.
  void open(const std::filesystem::path& file) {
    constexpr int attempts = 10;
    for (int attempt = 1;; ++attempt) {
      rig = make_rig(read_rig_file(file), {loop_period_s});
      try {
        return rig->open();
      } catch (const DeviceError&) {
        if (attempt == attempts) throw;
      }
    }
  }
  /// Until the voltage is on: a busy machine may let the device's own watchdog take it away again.
  void drive() {
    for (int i = 0; i < 200 && (i < 3 || ran_v != run_v); ++i) {
      rig->write(run_v);
      std::this_thread::sleep_for(std::chrono::milliseconds(15));
      rig->read();
      ran_v = device.voltage_v();
    }
  }

  Folder folder;
  FakeDevice device;
  std::unique_ptr<Rig> rig;
  double ran_v = 0.0;  ///< the device's voltage when driving ended
};

struct Stopped {
  StopReport report;
  double ran_v = 0.0;        ///< before the stop
  double at_report_v = 0.0;  ///< when the report was made
  double later_v = 0.0;      ///< and 0.2 s later, the rig destroyed
  bool enabled_later = true;
  double begun_s = 0.0;  ///< when the stop began, on the monotonic clock
  double took_s = 0.0;
  double on_for_s = 0.0;  ///< how long the voltage stayed, from the stop on
};

inline Stopped stopped(const StopCase& c, const StopWatcher& watcher = {}) {
  Driven driven(c);
  Stopped result;
  result.ran_v = driven.ran_v;
  driven.device.begin(c.trouble, c.for_s);
  MonotonicClock clock;
  const double begun_s = result.begun_s = monotonic_s();
  result.report = stop_and_wait(*driven.rig, clock, watcher);
  result.at_report_v = driven.device.voltage_v();
  result.took_s = monotonic_s() - begun_s;
  driven.rig.reset();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  result.later_v = driven.device.voltage_v();
  result.on_for_s = driven.device.voltage_since_s() - begun_s;
  result.enabled_later = driven.device.enabled();
  return result;
}

}  // namespace upright::test
