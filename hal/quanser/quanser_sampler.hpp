// A card that samples on its own time, and the thread that takes its samples.
//
// The library waits for a sample without a bound, and only the thread waits with it. The loop waits for the
// thread, with a bound of its own: a card that stops sampling is a link that gives no reply.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "quanser_card.hpp"

namespace upright {

struct CardSample {
  RawCounts counts;
  DeviceSample when;
  hil::Error error = 0;  ///< negative: the card has ended sampling, and what else is here is of before
};

class QuanserSampler {
 public:
  /// Starts to sample, and waits until it is known that the card does so every `period_s`. Throws DeviceError
  /// where it does not. `card` must outlive this.
  QuanserSampler(QuanserCard& card, double period_s, const std::string& rig_file);
  ~QuanserSampler();
  QuanserSampler(const QuanserSampler&) = delete;
  QuanserSampler& operator=(const QuanserSampler&) = delete;

  /// The newest sample; its number is 0 before the first.
  CardSample latest() const noexcept;
  /// Waits until there is another sample than the one of this number, or the card has ended sampling, at most
  /// until `until_ns`. Returns the newest.
  CardSample wait_for_another(std::uint64_t number, std::int64_t until_ns) const noexcept;

 private:
  /// Written anew only once the samples of all other slots have come, so that whoever copies one has time.
  struct Slot {
    std::atomic<std::uint64_t> number{0};
    std::atomic<std::int64_t> time_ns{0};
    std::atomic<std::int32_t> cart{0}, pendulum{0};
  };

  void take_samples() noexcept;
  void publish(std::uint64_t number, std::int64_t time_ns, const RawCounts& counts) noexcept;
  void end() noexcept;
  void require_period(double period_s, const std::string& rig_file) const;
  double measured_period_s(double period_s, const std::string& rig_file) const;

  QuanserCard& card_;
  hil::Task task_;
  std::array<Slot, 4> slots_;
  std::atomic<std::uint32_t> arrived_{0};  // changes with every sample, and when there will be none any more
  std::atomic<hil::Error> error_{0};
  std::thread thread_;
};

}  // namespace upright
