#include "sample_ring.hpp"

#include "hal/word_wait.hpp"
#include "upright/hal/clock.hpp"

namespace upright {

void SampleRing::publish(const RingSample& sample) noexcept {
  const std::uint32_t next = published_.load(std::memory_order_relaxed) + 1;
  Slot& slot = slots_[next % slots_.size()];
  slot.cart.store(sample.cart, std::memory_order_release);
  slot.pendulum.store(sample.pendulum, std::memory_order_release);
  slot.time_ns.store(sample.when.time_ns, std::memory_order_release);
  slot.trouble.store(sample.trouble, std::memory_order_release);
  slot.number.store(sample.when.number, std::memory_order_release);
  published_.store(next, std::memory_order_release);
  wake_one(published_);
}

RingSample SampleRing::latest() const noexcept {
  RingSample sample;
  for (;;) {
    const std::uint32_t published = published_.load(std::memory_order_acquire);
    const Slot& slot = slots_[published % slots_.size()];
    sample.cart = slot.cart.load(std::memory_order_acquire);
    sample.pendulum = slot.pendulum.load(std::memory_order_acquire);
    sample.when.time_ns = slot.time_ns.load(std::memory_order_acquire);
    sample.trouble = slot.trouble.load(std::memory_order_acquire);
    sample.when.number = slot.number.load(std::memory_order_acquire);
    // The slot is written anew for the fourth sample from here, which begins once the third has come.
    constexpr std::uint32_t safe_samples = 2;
    if (published_.load(std::memory_order_acquire) - published <= safe_samples) return sample;
  }
}

RingSample SampleRing::wait_for_another(std::uint64_t number, std::int64_t until_ns) const noexcept {
  for (;;) {
    const std::uint32_t published = published_.load(std::memory_order_acquire);
    const RingSample sample = latest();
    if (sample.when.number != number || sample.trouble != 0 || monotonic_ns() >= until_ns) return sample;
    wait_while(published_, published, until_ns);
  }
}

DeviceSample SampleReader::wait_next(const SampleRing& ring, std::int64_t until_ns) noexcept {
  const DeviceSample next = ring.wait_for_another(waited_for_, until_ns).when;
  waited_for_ = next.number;
  return next;
}

bool SampleReader::is_new(const RingSample& sample) noexcept {
  if (sample.when.number == read_) return false;
  read_ = sample.when.number;
  return true;
}

}  // namespace upright
