// Line encoders as a rig without an output.
//
// Edges are drained in read(), not by a thread of its own: the kernel stamps them and queues 1024 of them, so
// that a thread would wake for every edge, take the processor from the loop, and hand over counts that are no
// newer. What read() does is bounded by the queue, and a period in which the queue could fill is refused.
// Between two runs, when nobody reads, a keeper drains them: the zero was taken once, and must stay true.
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <thread>
#include <utility>

#include "edge_source.hpp"
#include "hal/gpio_rig.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/clock.hpp"

namespace upright {

namespace {

constexpr double share_of_queue = 0.5;  // a cycle may be late
constexpr std::int64_t keeper_pause_ns = 10'000'000;
constexpr std::int64_t nobody_reads_ns = 50'000'000;

class GpioEncoder {
 public:
  GpioEncoder(const LineEncoder& config, std::string use, int width_bits)
      : config_(config),
        use_(std::move(use)),
        width_bits_(width_bits),
        decoder_(config.fastest_edges_per_s) {}

  void open(const GpioChip& chip, const std::string& file, double period_s) {
    chip.line(config_.a, use_);
    chip.line(config_.b, use_);
    source_ = numbers_edges(chip) ? numbered_edges(chip, config_, use_) : stamped_edges(chip, config_, use_);
    refuse_slow_loop(file, period_s);
    begin();
  }
  void close() noexcept { source_.reset(); }

  RigFault catch_up(std::int64_t now_ns) noexcept {
    if (const RigFault fault = source_->drain(decoder_, now_ns); fault != RigFault::none) return fault;
    LinePair levels;
    if (!source_->read_levels(levels)) return decoder_.fail(RigFault::line_failed);
    return decoder_.compare(levels, now_ns);
  }

  std::int64_t counts() const noexcept { return signed_counts(decoder_.counts(), width_bits_); }

 private:
  void refuse_slow_loop(const std::string& file, double period_s) const {
    const double queued = share_of_queue * source_->queue_edges();
    if (config_.fastest_edges_per_s * period_s <= queued) return;
    throw ConfigError(file + ":1: the kernel's edge queue could overflow within a period of " +
                      exact_text(period_s) + " s: raise sample_rate_hz in the gain file to " +
                      exact_text(std::ceil(config_.fastest_edges_per_s / queued)) + ", or lower gpio." +
                      use_ + ".fastest_edges_per_s");
  }

  /// Finds a moment without an edge between the levels and what was drained.
  void begin() {
    constexpr int attempts = 200;
    MonotonicClock clock;
    for (int i = 0; i < attempts; ++i) {
      LinePair levels;
      if (!source_->read_levels(levels)) break;
      decoder_.start(levels);
      const RigFault fault = catch_up(clock.now_ns());
      if (fault == RigFault::none && decoder_.counts() == 0 && decoder_.levels() == levels) return;
      clock.sleep_until(clock.now_ns() + nanoseconds_per_second / 1000);
    }
    throw DeviceError("the lines of gpio." + use_ +
                      " changed or could not be read while the rig was opened: hold the encoder still then, "
                      "and check its wiring");
  }

  LineEncoder config_;
  std::string use_;
  int width_bits_;
  std::unique_ptr<EdgeSource> source_;
  QuadratureDecoder decoder_;
};

class GpioEncodersRig final : public Rig {
 public:
  GpioEncodersRig(const RigFile& file, double period_s)
      : chip_name_(file.gpio->chip), file_(file.file.string()), period_s_(period_s) {
    if (const auto& cart = file.gpio->cart_encoder)
      cart_.emplace(*cart, "cart_encoder", file.calibration.cart.width_bits);
    if (const auto& pendulum = file.gpio->pendulum_encoder)
      pendulum_.emplace(*pendulum, "pendulum_encoder", file.calibration.pendulum.width_bits);
  }

  ~GpioEncodersRig() override { end_keeper(); }

  void open() override {
    end_keeper();
    if (is_open_)
      refuse_lost_counts();
    else
      request();
    ending_ = false;
    keeper_ = std::thread([this] { keep(); });
  }

  RigReading read() noexcept override {
    RigReading reading;
    reading.time_ns = clock_.now_ns();
    last_read_ns_.store(reading.time_ns, std::memory_order_relaxed);
    if (busy_.test_and_set(std::memory_order_acquire)) {
      // The keeper has just begun; it is gone before the next cycle.
      reading.status = RigStatus::stale;
      return reading;
    }
    reading.fault = catch_up(reading.time_ns);
    if (cart_) reading.cart_counts = cart_->counts();
    if (pendulum_) reading.pendulum_counts = pendulum_->counts();
    busy_.clear(std::memory_order_release);
    if (reading.fault != RigFault::none) return reading;
    reading.sequence = ++sequence_;
    reading.status = RigStatus::fresh;
    return reading;
  }

  RigFault write(double) noexcept override { return RigFault::device_refused; }
  StopReport stop() noexcept override { return at_zero_volts(); }

 private:
  template <class Do>
  void each(Do act) {
    for (std::optional<GpioEncoder>* encoder : {&cart_, &pendulum_})
      if (*encoder) act(**encoder);
  }

  void request() {
    each([](GpioEncoder& encoder) { encoder.close(); });
    chip_.emplace(chip_name_, file_);
    each([this](GpioEncoder& encoder) { encoder.open(*chip_, file_, period_s_); });
    is_open_ = true;
  }

  /// Opened again it goes on counting, since its zero was taken before.
  void refuse_lost_counts() {
    if (catch_up(clock_.now_ns()) == RigFault::none) return;
    throw DeviceError(
        "encoder edges were lost or came faster than fastest_edges_per_s in the section gpio of " + file_ +
        ": start the program again to set a new zero");
  }

  RigFault catch_up(std::int64_t now_ns) noexcept {
    RigFault fault = RigFault::none;
    each([&](GpioEncoder& encoder) {
      const RigFault of_encoder = encoder.catch_up(now_ns);
      if (fault == RigFault::none) fault = of_encoder;
    });
    return fault;
  }

  void keep() noexcept {
    while (!ending_.load()) {
      const std::int64_t now_ns = clock_.now_ns();
      if (now_ns - last_read_ns_.load(std::memory_order_relaxed) > nobody_reads_ns &&
          !busy_.test_and_set(std::memory_order_acquire)) {
        catch_up(now_ns);  // a fault stays, for the next read() to tell
        busy_.clear(std::memory_order_release);
      }
      clock_.sleep_until(now_ns + keeper_pause_ns);
    }
  }
  void end_keeper() noexcept {
    if (!keeper_.joinable()) return;
    ending_ = true;
    keeper_.join();
  }

  std::string chip_name_, file_;
  double period_s_;
  MonotonicClock clock_;
  std::optional<GpioChip> chip_;  // owns lines of the encoders
  std::optional<GpioEncoder> cart_, pendulum_;
  bool is_open_ = false;
  std::uint64_t sequence_ = 0;
  std::atomic_flag busy_;
  std::atomic<std::int64_t> last_read_ns_{0};
  std::atomic<bool> ending_{false};
  std::thread keeper_;
};

}  // namespace

std::unique_ptr<Rig> make_gpio_encoders(const RigFile& file, double period_s) {
  return std::make_unique<GpioEncodersRig>(file, period_s);
}

}  // namespace upright
