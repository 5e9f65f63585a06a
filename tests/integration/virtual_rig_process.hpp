// A virtual rig as a second process, for tests of the real links.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace upright::test {

inline std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error("the text to replace is missing: " + from);
  return text.replace(at, from.size(), to);
}

/// A folder that goes when the test ends.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "upright-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// A child process whose first line "listening on NAME" is read.
class Process {
 public:
  explicit Process(std::vector<std::string> command) {
    int out[2];
    if (pipe(out) != 0) throw std::runtime_error("no pipe");
    id_ = fork();
    if (id_ == 0) {
      dup2(out[1], STDOUT_FILENO);
      close(out[0]);
      close(out[1]);
      std::vector<char*> arguments;
      for (std::string& word : command) arguments.push_back(word.data());
      arguments.push_back(nullptr);
      execvp(arguments[0], arguments.data());
      _exit(127);
    }
    close(out[1]);
    output_ = out[0];
  }
  ~Process() {
    end(SIGKILL);
    close(output_);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  std::string line() {
    std::string text;
    char c = 0;
    while (::read(output_, &c, 1) == 1 && c != '\n') text += c;
    return text;
  }
  /// Everything until the process closes its output.
  std::string rest() {
    std::string text;
    char buffer[4096];
    for (ssize_t n = 0; (n = ::read(output_, buffer, sizeof buffer)) > 0;)
      text.append(buffer, static_cast<std::size_t>(n));
    return text;
  }
  int wait() {
    int status = 0;
    if (id_ > 0) waitpid(id_, &status, 0);
    id_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  pid_t id() const { return id_; }
  int end(int signal_number) {
    if (id_ <= 0) return -1;
    kill(id_, signal_number);
    return wait();
  }

 private:
  pid_t id_ = -1;
  int output_ = -1;
};

/// The one run directory below a folder; empty: there is none yet.
inline std::filesystem::path only_entry(const std::filesystem::path& folder) {
  std::filesystem::path found;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) found = entry.path();
  return found;
}

/// Waits until the run has written its first rows: the motor is on. False: it does not begin.
inline bool wait_for_rows(const std::filesystem::path& runs) {
  for (int i = 0; i < 2000; ++i) {
    std::error_code none_yet;
    if (std::filesystem::exists(runs, none_yet)) {
      const std::filesystem::path run = only_entry(runs);
      const auto size = std::filesystem::file_size(run / "samples.csv", none_yet);
      if (!none_yet && size > 300) return true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

inline double monotonic_s() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct TraceRow {
  double time_s = 0, voltage_v = 0, cart_m = 0, theta_rad = 0;
  bool held = false;
};

inline std::vector<TraceRow> read_trace(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  std::vector<TraceRow> rows;
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    TraceRow row;
    if (words >> row.time_s >> row.voltage_v >> row.cart_m >> row.theta_rad >> row.held) rows.push_back(row);
  }
  return rows;
}

/// Where the cart was at any time from `from_s` to `to_s`: from the last line of the trace before to the
/// first after it, for a busy machine leaves gaps between lines.
struct CartRange {
  double low_m = 1e9, high_m = -1e9;
  bool holds(double cart_m) const {
    constexpr double count_m = 5e-5;  // two of them
    return cart_m >= low_m - count_m && cart_m <= high_m + count_m;
  }
};

inline CartRange cart_between(const std::vector<TraceRow>& trace, double from_s, double to_s) {
  const auto earlier = [](const TraceRow& row, double time_s) { return row.time_s < time_s; };
  auto first = std::lower_bound(trace.begin(), trace.end(), from_s, earlier);
  auto last = std::lower_bound(first, trace.end(), to_s, earlier);
  if (first != trace.begin()) --first;
  if (last != trace.end()) ++last;
  CartRange range;
  for (; first != last; ++first) {
    range.low_m = std::min(range.low_m, first->cart_m);
    range.high_m = std::max(range.high_m, first->cart_m);
  }
  return range;
}

/// `upright virtual-rig` on a free port or a new pseudo-terminal, with its trace.
class VirtualRigProcess {
 public:
  VirtualRigProcess(const Folder& folder, const std::string& rig_text, bool serial,
                    const std::vector<std::string>& flags = {}, const std::string& tcp = "127.0.0.1:0")
      : trace_(folder / "trace.csv"), process_(command(folder, rig_text, serial, flags, tcp)) {
    const std::string line = process_.line();
    const std::string starts = "listening on ";
    if (line.rfind(starts, 0) != 0) throw std::runtime_error("the virtual rig did not start: " + line);
    name_ = line.substr(starts.size());
  }

  const std::string& name() const { return name_; }
  int port() const { return std::stoi(name_.substr(name_.rfind(':') + 1)); }
  int end(int signal_number = SIGTERM) { return process_.end(signal_number); }
  std::vector<TraceRow> trace() const { return read_trace(trace_); }

 private:
  std::vector<std::string> command(const Folder& folder, const std::string& rig_text, bool serial,
                                   const std::vector<std::string>& flags, const std::string& tcp) const {
    const std::filesystem::path rig = folder / "virtual.yaml";
    std::ofstream(rig) << rig_text;
    std::vector<std::string> words = {UPRIGHT_BINARY, "virtual-rig",
                                      "--rig",        rig.string(),
                                      "--plant",      UPRIGHT_SOURCE_DIR "/config/plants/exponential.yaml",
                                      "--trace",      trace_.string()};
    words.insert(words.end(), {serial ? "--rtu" : "--tcp", serial ? (folder / "line").string() : tcp});
    words.insert(words.end(), flags.begin(), flags.end());
    return words;
  }

  std::filesystem::path trace_;
  std::string name_;
  Process process_;
};

}  // namespace upright::test
