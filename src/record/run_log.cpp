#include "run_log.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <vector>

#include "upright/base/error.hpp"

namespace upright {

namespace {

using namespace std::chrono_literals;

constexpr auto writer_pause = 10ms;
constexpr auto keep_pause = 50ms;
// Of a loop in virtual time: nothing but a simulation waits for a slow disk, only a dead writer ends it.
constexpr auto full_queue_patience = 60s;
constexpr std::size_t buffer_bytes = 64 * 1024;
constexpr std::size_t rows_at_once = 64;
constexpr int writer_priority = 5;  // below everything that moves the motor, above what merely computes

char* put(char* out, double value) noexcept {
  return std::to_chars(out, out + 40, value).ptr;
}
template <class Integer>
char* put_integer(char* out, Integer value) noexcept {
  return std::to_chars(out, out + 24, value).ptr;
}

/// A count of 10^-digits as a decimal fraction, exactly.
char* put_fixed(char* out, std::int64_t value, int digits) noexcept {
  std::uint64_t magnitude = static_cast<std::uint64_t>(value);
  if (value < 0) {
    *out++ = '-';
    magnitude = 0 - magnitude;
  }
  std::uint64_t unit = 1;
  for (int i = 0; i < digits; ++i) unit *= 10;
  out = put_integer(out, magnitude / unit);
  std::uint64_t rest = magnitude % unit;
  if (rest == 0) return out;
  *out++ = '.';
  for (; rest != 0; rest %= unit) {
    unit /= 10;
    *out++ = static_cast<char>('0' + rest / unit);
  }
  return out;
}

}  // namespace

std::size_t format_row(const LogRecord& r, char* const begin) noexcept {
  constexpr int nanoseconds = 9, nanoseconds_of_us = 3;
  char* out = put_integer(begin, r.tick);
  *out++ = ',';
  out = put_fixed(out, r.time_ns, nanoseconds);
  for (const std::int64_t counts : {r.cart_counts, r.pendulum_counts}) {
    *out++ = ',';
    out = put_integer(out, counts);
  }
  for (const double value : {r.cart_m, r.theta_rad, r.cart_velocity_mps, r.pendulum_rate_radps,
                             r.voltage_requested_v, r.voltage_v}) {
    *out++ = ',';
    out = put(out, value);
  }
  for (const std::int64_t ns : {r.wake_late_ns, r.read_ns, r.compute_ns, r.write_ns}) {
    *out++ = ',';
    out = put_fixed(out, ns, nanoseconds_of_us);
  }
  *out++ = ',';
  out = put_integer(out, r.flags);
  *out++ = ',';
  out = put_integer(out, r.sequence);
  *out++ = '\n';
  return static_cast<std::size_t>(out - begin);
}

RunLog::RunLog(const std::filesystem::path& file, const Options& options)
    : file_(file), options_(options), queue_(options.queue_rows), buffer_(buffer_bytes) {
  fd_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (fd_ < 0)
    throw Error(ExitCode::usage, "cannot create " + file.string() + " (" + std::strerror(errno) +
                                     "): check the folder and its free space");
  // By the folder's descriptor the file is found where somebody moves the whole folder.
  folder_fd_ = ::open((file.parent_path() / ".").c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
  const std::string header = std::string(sample_columns) + "\n";
  if (!write_all(header.data(), header.size())) {
    const std::string why = failure();
    close();
    throw Error(ExitCode::usage, why);
  }
  try {
    writer_ = std::thread([this] { write_loop(); });
    keeper_ = std::thread([this] { keep_loop(); });
  } catch (const std::exception&) {
    close();
    throw Error(ExitCode::device,
                "the log's writer thread could not start: raise the limit on threads (ulimit -u)");
  }
}

RunLog::~RunLog() {
  close();
}

/// From the loop: does the writer still move?
void RunLog::note_progress() noexcept {
  const std::uint64_t rounds = rounds_.load(std::memory_order_relaxed);
  rows_since_round_ = rounds == rounds_seen_ ? rows_since_round_ + 1 : 0;
  rounds_seen_ = rounds;
  if (rows_since_round_ > options_.stall_rows) stalled_.store(true, std::memory_order_relaxed);
}

bool RunLog::push(const LogRecord& record) noexcept {
  note_progress();
  if (queue_.push(record)) return true;
  dropped_.fetch_add(1, std::memory_order_relaxed);
  return false;
}

void RunLog::push_waiting(const LogRecord& record) noexcept {
  const auto patience = std::chrono::steady_clock::duration(full_queue_patience);
  if (queue_.push(record)) return;
  std::uint64_t rounds = rounds_.load(std::memory_order_relaxed);
  auto until = std::chrono::steady_clock::now() + patience;
  while (!queue_.push(record)) {
    std::this_thread::yield();
    const auto now = std::chrono::steady_clock::now();
    if (rounds != rounds_.load(std::memory_order_relaxed)) {
      rounds = rounds_.load(std::memory_order_relaxed);
      until = now + patience;
    }
    if (now < until) continue;
    stalled_.store(true, std::memory_order_relaxed);
    dropped_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
}

bool RunLog::write_all(const char* text, std::size_t size) noexcept {
  // Here, since what is written next would bring a file that was cut back to its length.
  struct stat held {};
  if (::fstat(fd_, &held) == 0 && held.st_size < size_.load(std::memory_order_relaxed)) {
    file_state_.store(LogFileState::cut, std::memory_order_relaxed);
    return false;
  }
  std::size_t done = 0;
  while (done < size) {
    const ssize_t written = ::write(fd_, text + done, size - done);
    if (written > 0) {
      done += static_cast<std::size_t>(written);
      continue;
    }
    if (written < 0 && errno == EINTR) continue;
    error_.store(written == 0 ? ENOSPC : errno, std::memory_order_relaxed);
    break;
  }
  if (done == size) {
    size_.fetch_add(static_cast<std::int64_t>(size), std::memory_order_release);
    return true;
  }
  // What arrived stays, up to its last whole row.
  while (done > 0 && text[done - 1] != '\n') --done;
  size_.fetch_add(static_cast<std::int64_t>(done), std::memory_order_release);
  rows_.fetch_add(static_cast<std::uint64_t>(std::count(text, text + done, '\n')), std::memory_order_relaxed);
  if (::ftruncate(fd_, size_) != 0) return false;
  return false;
}

void RunLog::flush() noexcept {
  if (used_ > 0 && !cannot_write() && write_all(buffer_.data(), used_)) {
    rows_.fetch_add(rows_in_buffer_, std::memory_order_relaxed);
    unsynced_.store(true, std::memory_order_relaxed);
  }
  used_ = 0;
  rows_in_buffer_ = 0;
  rounds_.fetch_add(1, std::memory_order_relaxed);
}

/// Rows are out of the queue only once they are text in the buffer: whoever comes after a writer that died
/// while it wrote finds them there.
void RunLog::drain() noexcept {
  static_assert(buffer_bytes >= 2 * rows_at_once * longest_row);
  std::array<LogRecord, rows_at_once> records;
  for (;;) {
    if (used_ + rows_at_once * longest_row > buffer_.size()) flush();
    const std::size_t count = queue_.pop(records.data(), records.size());
    if (count == 0) break;
    // After a failure rows are still taken, so that a waiting loop goes on to its stop.
    if (!cannot_write()) {
      for (std::size_t i = 0; i < count; ++i) used_ += format_row(records[i], buffer_.data() + used_);
      rows_in_buffer_ += count;
    }
    if (options_.watcher != nullptr) options_.watcher->see({records.data(), count});
  }
  flush();
}

void RunLog::write_loop() noexcept {
  if (options_.sync_while_running) {
    const sched_param parameters{writer_priority};
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);  // where allowed
  }
  for (;;) {
    const bool last_round = closing_.load(std::memory_order_acquire);
    drain();
    if (last_round) return;
    std::this_thread::sleep_for(writer_pause);
  }
}

void RunLog::look_after_file() noexcept {
  if (file_state_.load(std::memory_order_relaxed) != LogFileState::in_place) return;
  // Before the file is asked: the writer may go on meanwhile.
  const std::int64_t written = size_.load(std::memory_order_acquire);
  struct stat held {
  }, named{};
  if (::fstat(fd_, &held) != 0) return;
  LogFileState state = LogFileState::in_place;
  if (held.st_nlink == 0)
    state = LogFileState::removed;
  else if (::fstatat(folder_fd_, file_.filename().c_str(), &named, AT_SYMLINK_NOFOLLOW) != 0
               ? errno == ENOENT
               : named.st_ino != held.st_ino || named.st_dev != held.st_dev)
    state = LogFileState::moved;
  else if (held.st_size < written)
    state = LogFileState::cut;
  file_state_.store(state, std::memory_order_relaxed);
}

void RunLog::keep_loop() noexcept {
  while (!closing_.load(std::memory_order_acquire)) {
    look_after_file();
    if (options_.sync_while_running && unsynced_.exchange(false) && ::fdatasync(fd_) != 0 && errno != EINVAL)
      error_.store(errno, std::memory_order_relaxed);
    std::this_thread::sleep_for(keep_pause);
  }
}

void RunLog::close() noexcept {
  if (fd_ < 0) return;
  closing_.store(true, std::memory_order_release);
  if (writer_.joinable()) writer_.join();
  drain();  // what a writer that ended early left behind
  if (keeper_.joinable()) keeper_.join();
  look_after_file();
  if (::fdatasync(fd_) != 0 && errno != EINVAL && !cannot_write())
    error_.store(errno, std::memory_order_relaxed);
  ::close(fd_);
  if (folder_fd_ >= 0) ::close(folder_fd_);
  fd_ = folder_fd_ = -1;
}

std::string RunLog::failure() const {
  if (!failed()) return {};
  const std::string file = file_.string();
  switch (file_state_.load(std::memory_order_relaxed)) {
    case LogFileState::in_place:
      break;
    case LogFileState::removed: {
      std::error_code ignored;
      const bool folder_left = std::filesystem::exists(file_.parent_path(), ignored);
      return (folder_left ? file : "the run directory " + file_.parent_path().string()) +
             " was removed during the run, so its rows are lost: do not change it before the run has ended";
    }
    case LogFileState::moved:
      return file +
             " was moved or replaced during the run: do not change the run directory before the run has "
             "ended";
    case LogFileState::cut:
      return file +
             " was truncated by another program during the run, so rows are lost: do not change the run "
             "directory before the run has ended";
  }
  if (!cannot_write() && rows_dropped() == 0)
    return "writing " + file + " took longer than the log waits: use a faster disk for --out";
  if (!cannot_write())
    return "writing " + file + " took so long that " + std::to_string(rows_dropped()) +
           " rows were lost: use a faster disk for --out";
  return file + " could not be written (" + std::strerror(error_.load(std::memory_order_relaxed)) +
         "): free space on the disk of the run directory";
}

}  // namespace upright
