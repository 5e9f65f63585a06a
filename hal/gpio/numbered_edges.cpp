#include <fcntl.h>
#include <linux/gpio.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "edge_source.hpp"

namespace upright {

namespace {

constexpr std::uint32_t request_queue_size = 1024;  // the most that the kernel grants
constexpr std::size_t events_per_read = 64;
constexpr std::uint64_t both_lines = 3;

class LineDescriptor {
 public:
  explicit LineDescriptor(int descriptor = -1) noexcept : descriptor_(descriptor) {}
  ~LineDescriptor() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  LineDescriptor(const LineDescriptor&) = delete;
  LineDescriptor& operator=(const LineDescriptor&) = delete;
  int get() const noexcept { return descriptor_; }

 private:
  int descriptor_;
};

std::uint64_t flag_of(LineBias bias) noexcept {
  switch (bias) {
    case LineBias::pull_up:
      return GPIO_V2_LINE_FLAG_BIAS_PULL_UP;
    case LineBias::pull_down:
      return GPIO_V2_LINE_FLAG_BIAS_PULL_DOWN;
    case LineBias::as_is:
      break;
  }
  return 0;
}

int request(const GpioChip& chip, const LineEncoder& encoder, const std::string& use) {
  const LineDescriptor device(::open(chip.path().c_str(), O_RDWR | O_CLOEXEC));
  gpio_v2_line_request lines{};
  lines.offsets[0] = static_cast<std::uint32_t>(encoder.a);
  lines.offsets[1] = static_cast<std::uint32_t>(encoder.b);
  lines.num_lines = 2;
  lines.event_buffer_size = request_queue_size;
  std::strncpy(lines.consumer, gpio_consumer, sizeof lines.consumer - 1);
  lines.config.flags = GPIO_V2_LINE_FLAG_INPUT | GPIO_V2_LINE_FLAG_EDGE_RISING |
                       GPIO_V2_LINE_FLAG_EDGE_FALLING | flag_of(encoder.bias);
  if (device.get() < 0 || ::ioctl(device.get(), GPIO_V2_GET_LINE_IOCTL, &lines) != 0)
    chip.refuse(encoder.a, use);
  // Reading must not wait for an edge.
  ::fcntl(lines.fd, F_SETFL, ::fcntl(lines.fd, F_GETFL) | O_NONBLOCK);
  return lines.fd;
}

class NumberedEdges final : public EdgeSource {
 public:
  NumberedEdges(const GpioChip& chip, const LineEncoder& encoder, const std::string& use)
      : lines_(request(chip, encoder, use)), b_(static_cast<std::uint32_t>(encoder.b)) {}

  RigFault drain(QuadratureDecoder& decoder, std::int64_t now_ns) noexcept override {
    for (std::uint32_t seen = 0; seen < request_queue_size;) {
      const ssize_t size = ::read(lines_.get(), events_.data(), sizeof events_);
      if (size < 0 && errno != EAGAIN) return decoder.fail(RigFault::line_failed);
      const std::size_t events = size > 0 ? static_cast<std::size_t>(size) / sizeof events_[0] : 0;
      for (std::size_t i = 0; i < events; ++i)
        if (!take(events_[i], decoder)) return decoder.fail(RigFault::edges_lost);
      seen += static_cast<std::uint32_t>(events);
      if (events < events_per_read) break;
    }
    return wait_for_missing(decoder, now_ns);
  }

  bool read_levels(LinePair& levels) noexcept override {
    gpio_v2_line_values values{};
    values.mask = both_lines;
    if (::ioctl(lines_.get(), GPIO_V2_LINE_GET_VALUES_IOCTL, &values) != 0) return false;
    levels = {(values.bits & 1) != 0, (values.bits & 2) != 0};
    return true;
  }

  int queue_edges() const noexcept override { return request_queue_size; }

 private:
  bool take(const gpio_v2_line_event& event, QuadratureDecoder& decoder) noexcept {
    const bool level = event.id == GPIO_V2_LINE_EVENT_RISING_EDGE;
    if (!sequence_.put(event.seqno,
                       {event.offset == b_, level, static_cast<std::int64_t>(event.timestamp_ns)}))
      return false;
    Edge edge;
    while (sequence_.next(edge)) decoder.take(edge);
    return true;
  }

  /// An edge whose number is missing may still be on its way.
  RigFault wait_for_missing(QuadratureDecoder& decoder, std::int64_t now_ns) noexcept {
    if (!sequence_.waits()) {
      waits_ = false;
    } else if (!waits_) {
      waits_ = true;
      waits_since_ns_ = now_ns;
    } else if (now_ns - waits_since_ns_ > QuadratureDecoder::settling_ns) {
      return decoder.fail(RigFault::edges_lost);
    }
    return decoder.fault();
  }

  LineDescriptor lines_;
  std::uint32_t b_;
  EdgeSequence sequence_;
  bool waits_ = false;
  std::int64_t waits_since_ns_ = 0;
  std::array<gpio_v2_line_event, events_per_read> events_{};
};

}  // namespace

bool numbers_edges(const GpioChip& chip) {
  const LineDescriptor device(::open(chip.path().c_str(), O_RDWR | O_CLOEXEC));
  gpio_v2_line_info info{};
  return device.get() >= 0 && ::ioctl(device.get(), GPIO_V2_GET_LINEINFO_IOCTL, &info) == 0;
}

std::unique_ptr<EdgeSource> numbered_edges(const GpioChip& chip, const LineEncoder& encoder,
                                           const std::string& use) {
  return std::make_unique<NumberedEdges>(chip, encoder, use);
}

}  // namespace upright
