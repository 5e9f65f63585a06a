#include <fcntl.h>

#include <array>
#include <cerrno>

#include "edge_source.hpp"
#include "upright/hal/clock.hpp"

namespace upright {

namespace {

constexpr std::size_t line_queue_size = 16;  // for each line

gpiod_line* request(const GpioChip& chip, int number, LineBias bias, const std::string& use) {
  gpiod_line* line = chip.line(number, use);
  if (gpiod_line_request_both_edges_events_flags(line, gpio_consumer, bias_flag(bias)) != 0)
    chip.refuse(number, use);
  // Reading must not wait for an edge.
  const int descriptor = gpiod_line_event_get_fd(line);
  ::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) | O_NONBLOCK);
  return line;
}

std::int64_t nanoseconds(const timespec& time) noexcept {
  return time.tv_sec * nanoseconds_per_second + time.tv_nsec;
}

/// The edges of one line that are at hand.
class LineQueue {
 public:
  LineQueue(const GpioChip& chip, int number, LineBias bias, const std::string& use)
      : line_(request(chip, number, bias, use)) {}
  ~LineQueue() { gpiod_line_release(line_); }
  LineQueue(const LineQueue&) = delete;
  LineQueue& operator=(const LineQueue&) = delete;

  /// False when the line cannot be read.
  bool fetch() noexcept {
    next_ = size_ = 0;
    const int read =
        gpiod_line_event_read_fd_multiple(gpiod_line_event_get_fd(line_), events_.data(), line_queue_size);
    if (read > 0) size_ = static_cast<std::size_t>(read);
    return read >= 0 || errno == EAGAIN;
  }
  /// The kernel drops what comes when its queue is full.
  bool was_full() const noexcept { return size_ >= line_queue_size; }
  bool empty() const noexcept { return next_ == size_; }
  std::int64_t time_ns() const noexcept { return nanoseconds(events_[next_].ts); }
  Edge take(bool of_b) noexcept {
    const gpiod_line_event& event = events_[next_++];
    return {of_b, event.event_type == GPIOD_LINE_EVENT_RISING_EDGE, nanoseconds(event.ts)};
  }
  int level() noexcept { return gpiod_line_get_value(line_); }

 private:
  gpiod_line* line_;
  std::array<gpiod_line_event, line_queue_size> events_{};
  std::size_t next_ = 0, size_ = 0;
};

class StampedEdges final : public EdgeSource {
 public:
  StampedEdges(const GpioChip& chip, const LineEncoder& encoder, const std::string& use)
      : a_(chip, encoder.a, encoder.bias, use), b_(chip, encoder.b, encoder.bias, use) {}

  RigFault drain(QuadratureDecoder& decoder, std::int64_t) noexcept override {
    if (!a_.fetch() || !b_.fetch()) return decoder.fail(RigFault::line_failed);
    if (a_.was_full() || b_.was_full()) return decoder.fail(RigFault::edges_lost);
    while (!a_.empty() || !b_.empty()) {
      const bool of_b = a_.empty() || (!b_.empty() && b_.time_ns() < a_.time_ns());
      const Edge edge = of_b ? b_.take(true) : a_.take(false);
      if (edge.time_ns < last_ns_) return decoder.fail(RigFault::edges_lost);
      last_ns_ = edge.time_ns;
      decoder.take(edge);
    }
    return decoder.fault();
  }

  bool read_levels(LinePair& levels) noexcept override {
    const int a = a_.level(), b = b_.level();
    levels = {a > 0, b > 0};
    return a >= 0 && b >= 0;
  }

  int queue_edges() const noexcept override { return 2 * static_cast<int>(line_queue_size); }

 private:
  LineQueue a_, b_;
  std::int64_t last_ns_ = 0;
};

}  // namespace

std::unique_ptr<EdgeSource> stamped_edges(const GpioChip& chip, const LineEncoder& encoder,
                                          const std::string& use) {
  return std::make_unique<StampedEdges>(chip, encoder, use);
}

}  // namespace upright
