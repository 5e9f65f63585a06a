// The log of a run: a lock-free queue from the loop, a thread that writes samples.csv and one that syncs.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "upright/record/log_record.hpp"

namespace upright {

/// Largest length of a row as text, including its end of line.
inline constexpr std::size_t longest_row = 512;

/// Writes a row as text that reads back to the same bits; returns its length (at most `longest_row`).
std::size_t format_row(const LogRecord& record, char* out) noexcept;

/// Destination of the loop's rows.
class RowSink {
 public:
  virtual ~RowSink() = default;
  /// Called by the loop. False when there is no room; dropped rows are counted.
  virtual bool push(const LogRecord& record) noexcept = 0;
  /// Called by a loop in virtual time: waits for room, so that no row is dropped.
  virtual void push_waiting(const LogRecord& record) noexcept = 0;
  /// True once no further row will be kept.
  virtual bool failed() const noexcept = 0;
};

/// Keeps rows in memory, for rehearsals in virtual time. Unbounded.
class RowMemory final : public RowSink {
 public:
  bool push(const LogRecord& record) noexcept override {
    rows_.push_back(record);
    return true;
  }
  void push_waiting(const LogRecord& record) noexcept override { push(record); }
  bool failed() const noexcept override { return false; }
  std::vector<LogRecord> take() { return std::move(rows_); }  ///< the rows so far; none are left

 private:
  std::vector<LogRecord> rows_;
};

/// Changes that other programs have made to a log's file while it was written.
enum class LogFileState : std::uint8_t {
  in_place,
  removed,  ///< the file has no name any more: its rows are lost
  moved,    ///< moved out of its folder, or replaced by another file
  cut,      ///< shorter than what was written
};

/// Owns samples.csv. A row is passed to the kernel within about 20 ms of `push` and synced every 50 ms,
/// by separate threads, so that a slow disk delays neither the loop nor the writing.
class RunLog final : public RowSink {
 public:
  /// Sizes of the log.
  struct Options {
    std::size_t queue_rows = default_log_queue_rows;  ///< rows that may wait for the disk
    /// False: sync only at the end (virtual time, where only the simulation could be lost).
    bool sync_while_running = true;
    RowWatcher* watcher = nullptr;  ///< null: none. It must outlive the log.
    /// The log fails when its writer has made no progress during this many consecutive rows.
    std::size_t stall_rows = 8192;
  };

  /// Creates the file with its header line. Throws Error when that fails.
  RunLog(const std::filesystem::path& file, const Options& options);
  ~RunLog() override;
  RunLog(const RunLog&) = delete;
  RunLog& operator=(const RunLog&) = delete;

  /// From the loop: false when the queue is full, which is counted and is a failure of the log.
  bool push(const LogRecord& record) noexcept override;
  /// From a loop in virtual time: waits for room, so that no row is dropped.
  void push_waiting(const LogRecord& record) noexcept override;
  /// True once rows are missing or soon will be: a write failed, another program removed, moved or
  /// truncated the file, the queue was full, or the writer made no progress (the disk does not respond,
  /// or the thread has ended). `failure` gives the cause.
  bool failed() const noexcept override { return cannot_write() || rows_dropped() != 0 || stalled(); }

  /// Writes the queued rows, syncs and closes. May be called twice.
  void close() noexcept;
  /// Rows on the disk so far.
  std::uint64_t rows_written() const noexcept { return rows_.load(std::memory_order_relaxed); }
  /// Rows for which the queue had no room.
  std::uint64_t rows_dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }
  /// Empty, or why the log ended early, then the remedy.
  std::string failure() const;

 private:
  bool cannot_write() const noexcept {
    return error_.load(std::memory_order_relaxed) != 0 ||
           file_state_.load(std::memory_order_relaxed) != LogFileState::in_place;
  }
  /// Checks that the file still exists at its path, with all rows that were written.
  void look_after_file() noexcept;
  bool stalled() const noexcept { return stalled_.load(std::memory_order_relaxed); }
  void note_progress() noexcept;
  /// Writes the queued rows.
  void drain() noexcept;
  void flush() noexcept;
  void write_loop() noexcept;
  /// Monitors the file, and syncs it where requested.
  void keep_loop() noexcept;
  /// Writes text that ends with a complete row; on failure truncates the file to complete rows.
  bool write_all(const char* text, std::size_t size) noexcept;

  std::filesystem::path file_;
  Options options_;
  int fd_ = -1, folder_fd_ = -1;
  boost::lockfree::spsc_queue<LogRecord> queue_;
  std::atomic<std::uint64_t> rows_{0}, dropped_{0};
  std::atomic<std::uint64_t> rounds_{0};  // of the writer: increases as long as it runs
  std::atomic<bool> stalled_{false};
  std::uint64_t rounds_seen_ = 0;  // by the loop
  std::size_t rows_since_round_ = 0;
  std::atomic<int> error_{0};
  std::atomic<LogFileState> file_state_{LogFileState::in_place};
  std::atomic<bool> closing_{false}, unsynced_{false};
  std::atomic<std::int64_t> size_{0};  // bytes written; changed by the writer only
  std::vector<char> buffer_;           // text not yet written
  std::size_t used_ = 0;
  std::uint64_t rows_in_buffer_ = 0;
  std::thread writer_, keeper_;
};

}  // namespace upright
