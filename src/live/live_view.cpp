#include "live_view.hpp"

#include <array>
#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <chrono>
#include <cstddef>
#include <thread>
#include <vector>

#include "live_feed.hpp"
#include "live_server.hpp"
#include "runtime/realtime.hpp"

namespace upright {

namespace {

using namespace std::chrono_literals;

constexpr auto frame_pause = 40ms;
constexpr auto patience_at_end = 1000ms;
constexpr std::size_t queue_rows = 8192;

}  // namespace

class LiveView::Implementation {
 public:
  Implementation(const LiveScene& scene, const LiveOptions& options)
      : feed_(scene),
        queue_(queue_rows),
        server_(feed_, options.port, options.loop_cpu, options.stop),
        publisher_([this, cpu = options.loop_cpu] { publish_all(cpu); }) {}

  ~Implementation() {
    stopping_.store(true);
    publisher_.join();
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  void see(std::span<const LogRecord> rows) noexcept {
    const std::size_t taken = queue_.push(rows.data(), rows.size());
    unseen_.fetch_add(rows.size() - taken, std::memory_order_relaxed);
  }

  void end(const LiveState& state) {
    publish();
    feed_.end(state);
    feed_.wait_for_readers(patience_at_end);
  }

  LiveFeed& feed() { return feed_; }
  int port() const { return server_.port(); }

 private:
  void publish() {
    const std::lock_guard lock(publishing_);
    std::array<LogRecord, 256> part;
    rows_.clear();
    for (std::size_t count = 0; (count = queue_.pop(part.data(), part.size())) > 0;)
      rows_.insert(rows_.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(count));
    feed_.publish(rows_, unseen_.exchange(0));
  }

  void publish_all(int loop_cpu) {
    make_way(loop_cpu);
    while (!stopping_.load()) {
      publish();
      std::this_thread::sleep_for(frame_pause);
    }
  }

  LiveFeed feed_;
  boost::lockfree::spsc_queue<LogRecord> queue_;
  std::atomic<std::uint64_t> unseen_{0};
  std::mutex publishing_;  ///< the queue has one reader at a time
  std::vector<LogRecord> rows_;
  std::atomic<bool> stopping_{false};
  LiveServer server_;
  std::thread publisher_;
};

LiveView::LiveView(const LiveScene& scene, const LiveOptions& options)
    : implementation_(std::make_unique<Implementation>(scene, options)) {}

LiveView::~LiveView() = default;

std::string LiveView::url() const {
  return "http://127.0.0.1:" + std::to_string(implementation_->port()) + "/";
}

void LiveView::see(std::span<const LogRecord> rows) noexcept {
  implementation_->see(rows);
}

void LiveView::say(const LiveState& state) {
  implementation_->feed().say(state);
}

void LiveView::show_waiting(const std::string& text, double time_s, const Pose& pose) {
  implementation_->feed().show_waiting({LiveState::Kind::waiting, text}, time_s, pose);
}

void LiveView::end(const LiveState& state) {
  implementation_->end(state);
}

}  // namespace upright
