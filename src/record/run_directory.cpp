#include "upright/record/run_directory.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <type_traits>

#include "provenance.hpp"
#include "stop_report.hpp"
#include "upright/base/error.hpp"
#include "upright/control/delay_line.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/record/log_record.hpp"

namespace upright {

namespace {

constexpr const char* completed_name = ".run.yaml.completed";
constexpr std::size_t room_for_outcome = 64 * 1024;

std::string utc_now(const char* format) {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[40];
  std::strftime(text, sizeof text, format, &utc);
  return text;
}

std::string indented(const std::string& text) {
  std::string result;
  bool line_starts = true;
  for (const char c : text) {
    if (line_starts && c != '\n') result += "  ";
    result += c;
    line_starts = c == '\n';
  }
  return result;
}

std::string yes(bool value) {
  return value ? "true" : "false";
}

bool is_plain(const std::string& label) {
  constexpr std::size_t longest_label = 100;
  return !label.empty() && label.size() <= longest_label && label.front() != '.' &&
         std::all_of(label.begin(), label.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-';
         });
}

std::string device_text(const DeviceFacts& facts) {
  if (facts.empty()) return "";
  std::string text = "  device:\n";
  for (const auto& [name, value] : facts) text += "    " + name + ": " + yaml_quoted(value) + "\n";
  return text;
}

std::string provenance_text(const DeviceFacts& device) {
  const Provenance p = provenance();
  return "provenance:\n  version: " + yaml_quoted(p.version) +
         "\n  git_commit: " + yaml_quoted(p.git_commit) + "\n  git_dirty: " + yes(p.git_dirty) +
         "\n  compiler: " + yaml_quoted(p.compiler) + "\n  host: " + yaml_quoted(p.host) +
         "\n  kernel: " + yaml_quoted(p.kernel) + "\n  machine: " + yaml_quoted(p.machine) + "\n" +
         device_text(device);
}

std::string scheduling_text(const RealtimeGrant& grant) {
  return "scheduling:\n  policy: " + grant.policy + "\n  priority: " + std::to_string(grant.priority) +
         "\n  memory_locked: " + yes(grant.memory_locked) + "\n  cpu: " + std::to_string(grant.cpu) +
         "\n  note: " + yaml_quoted(grant.note) + "\n";
}

std::string loop_text(const RunSetup& setup) {
  const DelayLine delay(setup.control.delay_s, setup.control.period_s());
  const LoopLimits& limits = setup.limits;
  return "loop:\n  periods: " + std::to_string(limits.periods) +
         "\n  track_limit_m: " + exact_text(limits.track_limit_m) +
         "\n  coast_s: " + exact_text(limits.coast_s) +
         "\n  fall_angle_rad: " + exact_text(limits.fall_angle_rad) +
         "\n  watchdog_s: " + exact_text(limits.watchdog_s) +
         "\n  most_periods_late: " + std::to_string(limits.max_periods_late) +
         "\n  spin_us: " + exact_text(static_cast<double>(limits.spin_ns) / 1e3) +
         "\n  encoder_watch: " + encoder_assumptions_text(limits.encoders) +
         "\n  delay_is_exact: " + yes(delay.exact()) + "  # false: linear between samples\n" +
         "  delay_periods: " + exact_text(static_cast<double>(delay.whole_periods()) + delay.fraction()) +
         "\n";
}

std::string flags_text() {
  struct Bit {
    const char* name;
    std::uint32_t bit;
  };
  constexpr Bit bits[] = {{"stale", row_flag::stale},
                          {"fault", row_flag::fault},
                          {"saturated", row_flag::saturated},
                          {"overrun_wake", row_flag::overrun_wake},
                          {"overrun_read", row_flag::overrun_read},
                          {"overrun_compute", row_flag::overrun_compute},
                          {"overrun_write", row_flag::overrun_write},
                          {"missed", row_flag::missed},
                          {"write_failed", row_flag::write_failed},
                          {"stopped", row_flag::stopped},
                          {"feedback", row_flag::feedback}};
  std::string text = "flags: {";
  for (const Bit& bit : bits)
    text += std::string(bit.bit == 1 ? "" : ", ") + bit.name + ": " + std::to_string(bit.bit);
  return text + "}\n";
}

std::string histogram_text(const char* name, const DurationHistogram& h) {
  std::string text = std::string("    ") + name + ":\n      mean_us: " + exact_text(h.mean_us()) +
                     "\n      p50_us: " + exact_text(h.quantile_us(0.5)) +
                     "\n      p99_us: " + exact_text(h.quantile_us(0.99)) +
                     "\n      p99_9_us: " + exact_text(h.quantile_us(0.999)) +
                     "\n      max_us: " + exact_text(h.max_us()) + "\n      histogram_upper_us: [";
  std::string counts;
  for (std::size_t i = 0; i < h.buckets().size(); ++i) {
    if (h.buckets()[i] == 0) continue;
    text += (counts.empty() ? "" : ", ") + exact_text(static_cast<double>(h.upper_end_ns(i)) / 1e3);
    counts += (counts.empty() ? "" : ", ") + std::to_string(h.buckets()[i]);
  }
  return text + "]\n      histogram_count: [" + counts + "]\n";
}

/// Of what for_each_count lists.
template <class Counts>
std::string counts_text(const Counts& counts) {
  std::string text;
  for_each_count(counts, [&](const char* name, auto count) {
    text += (text.empty() ? "{" : ", ") + std::string(name) + ": " + std::to_string(count);
  });
  return text + "}";
}

std::string yaml_of(bool value) {
  return yes(value);
}
std::string yaml_of(const char* word) {
  return word;
}
std::string yaml_of(const std::string& sentence) {
  return yaml_quoted(sentence);
}

std::string device_clock_text(const DeviceTiming& timing) {
  std::string text;
  for_each_fact(timing, [&](const char* name, auto value) {
    text += (text.empty() ? "  device_clock: {" : ", ") + std::string(name) + ": ";
    if constexpr (std::is_floating_point_v<decltype(value)>)
      text += exact_text(value);
    else
      text += std::to_string(value);
  });
  return text + "}\n";
}

std::string outcome_text(const LoopOutcome& o, const LoopLimits& limits, const LogSummary& log) {
  std::string text = "outcome:\n  result: " + std::string(result_of(o)) + "\n  reason: " + name_of(o.reason) +
                     "\n  sentence: " + yaml_quoted(sentence_of(o, limits, log)) +
                     "\n  time_s: " + exact_text(o.time_s) +
                     "\n  started_monotonic_s: " + exact_text(static_cast<double>(o.start_ns) * 1e-9) +
                     "\n  tick: " + std::to_string(o.first_bad_tick) +
                     "\n  worst_theta_rad: " + exact_text(o.worst_theta_rad) +
                     "\n  worst_cart_m: " + exact_text(o.worst_cart_m) + "\n";
  for_each_fact(o.stop, [&](const char* name, const auto& fact) {
    text += std::string("  ") + name + ": " + yaml_of(fact) + "\n";
  });
  text += "  rows_written: " + std::to_string(log.rows_written) +
          "\n  rows_dropped: " + std::to_string(log.rows_dropped) + "\n";
  if (!log.failure.empty()) text += "  log_failure: " + yaml_quoted(log.failure) + "\n";
  text += "  counts: " + counts_text(o.counts) + "\n  link: " + counts_text(o.counts.link) + "\n";
  if (o.device_clock) text += device_clock_text(*o.device_clock);
  text += "  timing:\n";
  for_each_timing(o,
                  [&](const char* name, const auto& histogram) { text += histogram_text(name, histogram); });
  return text;
}

/// Writes a whole file of a folder over whatever room it has already, and syncs it.
bool write_file(int folder, const char* name, const std::string& text, std::size_t room) {
  const int fd = ::openat(folder, name, O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (fd < 0) return false;
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t written = ::write(fd, text.data() + done, text.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) break;
    done += static_cast<std::size_t>(written);
  }
  bool good = done == text.size();
  if (room > 0)
    good = good && ::posix_fallocate(fd, 0, static_cast<off_t>(room)) == 0;
  else
    good = good && ::ftruncate(fd, static_cast<off_t>(text.size())) == 0;
  good = ::fsync(fd) == 0 && good;
  return ::close(fd) == 0 && good;
}

}  // namespace

const char* result_of(const LoopOutcome& outcome) noexcept {
  if (outcome.reason == StopReason::duration) return "completed";
  return outcome.reason == StopReason::fell ? "fell" : "stopped";
}

std::string sentence_of(const LoopOutcome& outcome, const LoopLimits& limits, const LogSummary& log) {
  const std::string sentence = sentence_of(outcome, limits);
  if (outcome.reason != StopReason::log_failed || log.failure.empty()) return sentence;
  return sentence + ": " + log.failure;
}

RunDirectory::RunDirectory(const std::filesystem::path& parent, const std::string& label) {
  if (!is_plain(label))
    throw ConfigError(
        "the label '" + label +
        "' has a character that folder names cannot have: use letters, digits, '.', '_' and '-' in --label");
  std::error_code problem;
  std::filesystem::create_directories(parent, problem);
  if (problem)
    throw ConfigError("the folder " + parent.string() + " cannot be created or written (" +
                      problem.message() + "): name another with --out");
  started_utc_ = utc_now("%Y-%m-%dT%H:%M:%SZ");
  const std::string name = utc_now("%Y%m%dT%H%M%SZ") + "-" + label;
  constexpr int max_tries = 10000;
  for (int i = 1; i <= max_tries; ++i) {
    path_ = parent / (i == 1 ? name : name + "-" + std::to_string(i));
    if (std::filesystem::create_directory(path_, problem)) {
      hold();
      return;
    }
    if (problem) break;
  }
  throw ConfigError("cannot create " + path_.string() + " (" + problem.message() +
                    "): name a folder that can be written");
}

RunDirectory::~RunDirectory() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void RunDirectory::hold() {
  descriptor_ = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0)
    throw ConfigError("cannot open " + path_.string() + " (" + std::strerror(errno) +
                      "): name a folder that can be written");
}

std::filesystem::path RunDirectory::path_now() const {
  struct stat held {
  }, named{};
  if (::fstat(descriptor_, &held) != 0) return {};
  if (::stat(path_.c_str(), &named) == 0 && named.st_ino == held.st_ino && named.st_dev == held.st_dev)
    return path_;
  // The kernel's own name for it; one that was removed no longer leads there.
  std::error_code problem;
  std::filesystem::path now =
      std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(descriptor_), problem);
  if (problem || ::stat(now.c_str(), &named) != 0 || named.st_ino != held.st_ino ||
      named.st_dev != held.st_dev)
    return {};
  return now;
}

void RunDirectory::write_start(const RunSetup& setup) {
  std::string text =
      "run:\n  format: 1\n  label: " + yaml_quoted(setup.label) +
      "\n  started_utc: " + yaml_quoted(started_utc_) + "\n  command: " + yaml_quoted(setup.command) +
      "\n  duration_s: " + exact_text(setup.duration_s) + "\n  virtual_time: " + yes(setup.fast) +
      "\n  seed: " + std::to_string(setup.seed) + "\n";
  if (setup.theta0_rad) text += "  theta0_rad: " + exact_text(*setup.theta0_rad) + "\n";
  text += provenance_text(setup.device) + scheduling_text(setup.scheduling) + loop_text(setup);
  text += "controller:\n" + indented(gain_text(setup.control));
  text += "rig:\n" + indented(rig_text(setup.rig));
  if (setup.plant) text += plant_text(*setup.plant);
  text += setup.experiment_text;
  text += flags_text();
  start_text_ = text;
  if (!write_file(descriptor_, "run.yaml", text, 0) ||
      !write_file(descriptor_, completed_name, "", room_for_outcome))
    throw ConfigError("cannot write " + (path_ / "run.yaml").string() +
                      ": free space on the disk of the run directory");
  ::fsync(descriptor_);
}

bool RunDirectory::write_outcome(const LoopOutcome& outcome, const LoopLimits& limits,
                                 const LogSummary& log) noexcept {
  try {
    if (!write_file(descriptor_, completed_name, start_text_ + outcome_text(outcome, limits, log), 0) ||
        ::renameat(descriptor_, completed_name, descriptor_, "run.yaml") != 0)
      return false;
    ::fsync(descriptor_);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace upright
