// The samples of a device that samples on its own time, handed from the thread that takes them to the loop.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "upright/hal/rig.hpp"

namespace upright {

/// What a device sent on its own time.
struct RingSample {
  DeviceSample when;
  std::int64_t cart = 0, pendulum = 0;  ///< counts
  /// Not 0: no further sample came, for a reason that has this number with the backend. The rest is the
  /// latest sample's.
  std::int32_t trouble = 0;
};

/// One thread publishes, one other thread reads. Neither waits for the other.
class SampleRing {
 public:
  void publish(const RingSample& sample) noexcept;
  /// The newest; its number is 0 before the first.
  RingSample latest() const noexcept;
  /// Waits until there is another sample than the one of this number, or trouble, at most until `until_ns` on
  /// the monotonic clock. Returns the newest.
  RingSample wait_for_another(std::uint64_t number, std::int64_t until_ns) const noexcept;

 private:
  /// Written anew only once all other slots were, so that whoever copies one has time.
  struct Slot {
    std::atomic<std::uint64_t> number{0};
    std::atomic<std::int64_t> time_ns{0}, cart{0}, pendulum{0};
    std::atomic<std::int32_t> trouble{0};
  };

  std::array<Slot, 4> slots_;
  std::atomic<std::uint32_t> published_{0};
};

/// What the loop has waited for and read of a ring.
class SampleReader {
 public:
  /// As Rig::wait_next.
  DeviceSample wait_next(const SampleRing& ring, std::int64_t until_ns) noexcept;
  /// Whether this sample was not read before. It is then.
  bool is_new(const RingSample& sample) noexcept;

 private:
  std::uint64_t waited_for_ = 0, read_ = 0;
};

}  // namespace upright
