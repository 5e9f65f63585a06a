// From the loop to samples.csv: a lock-free queue, a thread that writes and a thread that syncs.
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

/// Longest a row takes as text, with its end of line.
inline constexpr std::size_t longest_row = 512;

/// Writes a row as text that reads back to the same bits; returns its length (at most `longest_row`).
std::size_t format_row(const LogRecord& record, char* out) noexcept;

/// Where the loop's rows go.
class RowSink {
 public:
  virtual ~RowSink() = default;
  /// From the loop: false, and counted, when there is no room.
  virtual bool push(const LogRecord& record) noexcept = 0;
  /// From a loop in virtual time: waits for room, so that no row is dropped.
  virtual void push_waiting(const LogRecord& record) noexcept = 0;
  /// True once no further row will be kept.
  virtual bool failed() const noexcept = 0;
};

/// Keeps rows in memory, for rehearsals in virtual time: it grows.
class RowMemory final : public RowSink {
 public:
  bool push(const LogRecord& record) noexcept override {
    rows_.push_back(record);
    return true;
  }
  void push_waiting(const LogRecord& record) noexcept override { push(record); }
  bool failed() const noexcept override { return false; }
  std::vector<LogRecord> take() { return std::move(rows_); }

 private:
  std::vector<LogRecord> rows_;
};

/// Sees the rows on their way to the file. It is called by the thread that writes, which it must not hold up:
/// no lock, no waiting.
class RowWatcher {
 public:
  virtual ~RowWatcher() = default;
  virtual void see(std::span<const LogRecord> rows) noexcept = 0;
};

/// What other programs did to a log's file while it was written.
enum class LogFileState : std::uint8_t {
  in_place,
  removed,  ///< no name leads to its rows any more: they are lost
  moved,    ///< out of its folder, or another file stands in its place
  cut,      ///< it is shorter than what was written
};

/// Owns samples.csv. A row is in the kernel within about 20 ms of `push` and asked onto the disk every 50 ms,
/// each by its own thread, so that a slow disk delays neither the loop nor the writing.
class RunLog final : public RowSink {
 public:
  struct Options {
    std::size_t queue_rows = 16384;
    /// False: only once at the end (virtual time, where nothing but the simulation is lost).
    bool sync_while_running = true;
    RowWatcher* watcher = nullptr;  ///< null: nobody. It must outlive the log.
    /// The log has failed when its writer has not moved for so many rows in a row.
    std::size_t stall_rows = 8192;
  };

  /// Creates the file with its header line. Throws Error when that fails.
  RunLog(const std::filesystem::path& file, const Options& options);
  ~RunLog() override;
  RunLog(const RunLog&) = delete;
  RunLog& operator=(const RunLog&) = delete;

  /// From the loop: false, counted, and a failure of the log when the queue is full.
  bool push(const LogRecord& record) noexcept override;
  /// From a loop in virtual time: waits for room, so that no row is dropped.
  void push_waiting(const LogRecord& record) noexcept override;
  /// True once rows are missing or soon will be: a write failed, the file was removed, moved or cut by
  /// another program, the queue was full, or the writer stands still (its disk does not answer, or its thread
  /// is gone). `failure` says why.
  bool failed() const noexcept override { return cannot_write() || rows_dropped() != 0 || stalled(); }

  /// Writes what is queued, syncs and closes. Safe to call twice.
  void close() noexcept;
  std::uint64_t rows_written() const noexcept { return rows_.load(std::memory_order_relaxed); }
  std::uint64_t rows_dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }
  /// Empty, or why the log ended early, then the remedy.
  std::string failure() const;

 private:
  bool cannot_write() const noexcept {
    return error_.load(std::memory_order_relaxed) != 0 ||
           file_state_.load(std::memory_order_relaxed) != LogFileState::in_place;
  }
  /// Looks whether the file is still where it was made, with all that was written.
  void look_after_file() noexcept;
  bool stalled() const noexcept { return stalled_.load(std::memory_order_relaxed); }
  void note_progress() noexcept;
  /// Writes what is queued.
  void drain() noexcept;
  void flush() noexcept;
  void write_loop() noexcept;
  /// Looks after the file, and syncs it where that is asked for.
  void keep_loop() noexcept;
  /// Writes text that ends with a whole row; on failure cuts the file back to whole rows.
  bool write_all(const char* text, std::size_t size) noexcept;

  std::filesystem::path file_;
  Options options_;
  int fd_ = -1, folder_fd_ = -1;
  boost::lockfree::spsc_queue<LogRecord> queue_;
  std::atomic<std::uint64_t> rows_{0}, dropped_{0};
  std::atomic<std::uint64_t> rounds_{0};  // of the writer: grows while it lives
  std::atomic<bool> stalled_{false};
  std::uint64_t rounds_seen_ = 0;  // by the loop
  std::size_t rows_since_round_ = 0;
  std::atomic<int> error_{0};
  std::atomic<LogFileState> file_state_{LogFileState::in_place};
  std::atomic<bool> closing_{false}, unsynced_{false};
  std::atomic<std::int64_t> size_{0};  // written; changed by the writer only
  std::vector<char> buffer_;           // text not yet written
  std::size_t used_ = 0;
  std::uint64_t rows_in_buffer_ = 0;
  std::thread writer_, keeper_;
};

}  // namespace upright
