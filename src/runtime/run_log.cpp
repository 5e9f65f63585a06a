#include "upright/runtime/run_log.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <vector>

#include "upright/model/error.hpp"

namespace upright {

namespace {

using namespace std::chrono_literals;

constexpr auto writer_pause = 10ms;
constexpr auto sync_pause = 50ms;
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
    throw Error(ExitCode::usage, "check the folder and its free space: cannot create " + file.string() +
                                     " (" + std::strerror(errno) + ")");
  const std::string header = std::string(sample_columns) + "\n";
  if (!write_all(header.data(), header.size())) {
    ::close(fd_);
    throw Error(ExitCode::usage, failure());
  }
  try {
    writer_ = std::thread([this] { write_loop(); });
    if (options_.sync_while_running) syncer_ = std::thread([this] { sync_loop(); });
  } catch (const std::exception&) {
    close();
    throw Error(ExitCode::device, "raise the limit on threads (ulimit -u): the log's writer could not start");
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
    size_ += static_cast<std::int64_t>(size);
    return true;
  }
  // What arrived stays, up to its last whole row.
  while (done > 0 && text[done - 1] != '\n') --done;
  size_ += static_cast<std::int64_t>(done);
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

void RunLog::sync_loop() noexcept {
  while (!closing_.load(std::memory_order_acquire)) {
    if (unsynced_.exchange(false) && ::fdatasync(fd_) != 0 && errno != EINVAL)
      error_.store(errno, std::memory_order_relaxed);
    std::this_thread::sleep_for(sync_pause);
  }
}

void RunLog::close() noexcept {
  if (fd_ < 0) return;
  closing_.store(true, std::memory_order_release);
  if (writer_.joinable()) writer_.join();
  drain();  // what a writer that ended early left behind
  if (syncer_.joinable()) syncer_.join();
  if (::fdatasync(fd_) != 0 && errno != EINVAL && !cannot_write())
    error_.store(errno, std::memory_order_relaxed);
  ::close(fd_);
  fd_ = -1;
}

std::string RunLog::failure() const {
  if (!failed()) return {};
  if (!cannot_write() && rows_dropped() == 0)
    return "use a faster disk for --out: it held up " + file_.string() + " for longer than the log waits";
  if (!cannot_write())
    return "use a faster disk for --out: it held up " + file_.string() + " until " +
           std::to_string(rows_dropped()) + " rows were lost";
  return "free space where the run directory goes: " + file_.string() + " could not be written (" +
         std::strerror(error_.load(std::memory_order_relaxed)) + ")";
}

}  // namespace upright
