#include "live_feed.hpp"

#include <algorithm>
#include <utility>

namespace upright {

void LiveFeed::post(std::string event) {
  events_.push_back(std::move(event));
  while (events_.size() > kept_events) {
    events_.pop_front();
    ++first_number_;
  }
  if (wake_) wake_();
}

void LiveFeed::wake_with(std::function<void()> wake) {
  const std::lock_guard lock(mutex_);
  wake_ = std::move(wake);
}

void LiveFeed::publish(std::span<const LogRecord> rows, std::uint64_t unseen) {
  const std::lock_guard lock(mutex_);
  if (ended_) return;
  for (const LogRecord& row : rows) maker_.add(row);
  if (unseen > 0) maker_.note_unseen(unseen);
  post(event_text("frame", maker_.frame_json()));
}

void LiveFeed::say(const LiveState& state) {
  const std::lock_guard lock(mutex_);
  maker_.say(state);
}

void LiveFeed::show_waiting(const LiveState& state, double time_s, const Pose& pose) {
  const std::lock_guard lock(mutex_);
  maker_.say(state);
  maker_.add_pose(time_s, pose);
}

void LiveFeed::end(const LiveState& state) {
  const std::lock_guard lock(mutex_);
  if (ended_) return;
  maker_.say(state);
  maker_.rest();
  ended_ = true;
  post(event_text("end", maker_.frame_json()));
}

std::size_t LiveFeed::readers() const {
  const std::lock_guard lock(mutex_);
  return readers_;
}

bool LiveFeed::wait_for_readers(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  return left_.wait_for(lock, patience, [this] { return readers_ == 0; });
}

LiveFeed::Reader::Reader(LiveFeed& feed) : feed_(feed) {
  const std::lock_guard lock(feed_.mutex_);
  ++feed_.readers_;
}

LiveFeed::Reader::~Reader() {
  const std::lock_guard lock(feed_.mutex_);
  --feed_.readers_;
  feed_.left_.notify_all();
}

std::string LiveFeed::Reader::next() {
  const std::lock_guard lock(feed_.mutex_);
  if (!welcomed_) {
    welcomed_ = true;
    over_ = feed_.ended_;
    number_ = feed_.first_number_ + feed_.events_.size();
    return event_text("scene", feed_.maker_.scene_json()) +
           event_text(over_ ? "end" : "frame", feed_.maker_.history_json());
  }
  const auto last = [this] { return feed_.first_number_ + feed_.events_.size(); };
  std::string text;
  number_ = std::max(number_, feed_.first_number_);
  for (; number_ < last(); ++number_) text += feed_.events_[number_ - feed_.first_number_];
  over_ = feed_.ended_;
  return text;
}

}  // namespace upright
