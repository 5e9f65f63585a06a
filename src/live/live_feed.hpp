// What the server's threads share: the frames of the last seconds, numbered, and who has read how far. Locks,
// so neither the loop nor the log's writer comes here.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <span>
#include <string>

#include "frame_maker.hpp"

namespace upright {

class LiveFeed {
 public:
  explicit LiveFeed(const LiveScene& scene) : maker_(scene) {}

  /// `wake` is called, under the feed's lock, whenever there is something new for the readers. Before the
  /// first of them.
  void wake_with(std::function<void()> wake);

  /// Takes rows in, and lets readers have the next frame.
  void publish(std::span<const LogRecord> rows, std::uint64_t unseen);
  void say(const LiveState& state);
  void show_waiting(const LiveState& state, double time_s, const Pose& pose);
  /// The last event: how it ended.
  void end(const LiveState& state);

  /// A stream from its beginning to its end; counted, so that the end can wait for it.
  class Reader {
   public:
    explicit Reader(LiveFeed& feed);
    ~Reader();
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;

    /// Events as text: scene and history first, then what is new; empty: nothing came. One who fell far
    /// behind goes on with the oldest frame that is kept.
    std::string next();
    /// True once everything was read and nothing will come.
    bool over() const { return over_; }

   private:
    LiveFeed& feed_;
    std::uint64_t number_ = 0;  ///< of the event to read next
    bool welcomed_ = false, over_ = false;
  };

  std::size_t readers() const;
  /// Waits until no reader is left; false: some still are.
  bool wait_for_readers(std::chrono::milliseconds patience);

 private:
  void post(std::string event);

  static constexpr std::size_t kept_events = 128;

  mutable std::mutex mutex_;
  std::condition_variable left_;  ///< a reader did
  std::function<void()> wake_;
  FrameMaker maker_;
  std::deque<std::string> events_;
  std::uint64_t first_number_ = 0;  ///< of events_
  std::size_t readers_ = 0;
  bool ended_ = false;
};

}  // namespace upright
