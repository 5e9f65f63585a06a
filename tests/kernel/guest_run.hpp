// The files of a run in the guest, and how it is started.
#pragma once

#include <fstream>
#include <string>
#include <vector>

#include "../fault/process_case.hpp"
#include "../integration/virtual_rig_process.hpp"

namespace upright::test {

/// The console is for the tests' own words.
inline std::vector<std::string> quiet(const std::string& command) {
  return {"sh", "-c", "exec " UPRIGHT_BINARY " " + command + " 2>/dev/null"};
}

class GuestRun {
 public:
  static constexpr int rate_hz = 200;

  explicit GuestRun(const std::string& rig_text, int sample_rate_hz = rate_hz) {
    std::ofstream(rig_file()) << rig_text;
    std::ofstream(gain_file()) << replaced(text_of(UPRIGHT_SOURCE_DIR "/config/gains/exponential.yaml"),
                                           "sample_rate_hz: 1000",
                                           "sample_rate_hz: " + std::to_string(sample_rate_hz));
  }
  std::filesystem::path rig_file() const { return folder_ / "rig.yaml"; }
  std::filesystem::path gain_file() const { return folder_ / "gains.yaml"; }
  std::filesystem::path trace() const { return folder_ / "trace.csv"; }
  std::filesystem::path runs() const { return folder_ / "runs"; }

  std::vector<std::string> command(double duration_s, const std::string& more = "") const {
    return quiet("run --unchecked --rig " + rig_file().string() + " --gains " + gain_file().string() +
                 " --out " + runs().string() + " --duration " + std::to_string(duration_s) + more);
  }
  ProcessFiles files(double duration_s) const {
    return {command(duration_s), rig_file(), runs(), folder_ / "struck"};
  }

 private:
  Folder folder_;
};

}  // namespace upright::test
