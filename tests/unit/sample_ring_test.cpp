// The samples of a device, from one thread to another.
#include "../../hal/sample_ring.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "upright/hal/clock.hpp"

namespace upright {
namespace {

constexpr std::int64_t long_ns = 5'000'000'000;

TEST(SampleRing, GivesTheNewestSample) {
  SampleRing ring;
  EXPECT_EQ(ring.latest().when.number, 0u);
  for (std::uint64_t number = 1; number <= 9; ++number)
    ring.publish({{number, 0}, static_cast<std::int64_t>(number), 0});
  EXPECT_EQ(ring.latest().when.number, 9u);
  EXPECT_EQ(ring.latest().cart, 9);
}

TEST(SampleRing, WaitsNoLongerThanItMay) {
  SampleRing ring;
  ring.publish({{1, 0}});
  EXPECT_EQ(ring.wait_for_another(1, monotonic_ns() + 1'000'000).when.number, 1u);
  EXPECT_EQ(ring.wait_for_another(0, 0).when.number, 1u) << "there is another one already";
}

TEST(SampleRing, TroubleEndsAWait) {
  SampleRing ring;
  ring.publish({{1, 0}});
  std::thread device([&] { ring.publish({{1, 0}, 0, 0, 7}); });
  EXPECT_EQ(ring.wait_for_another(1, monotonic_ns() + long_ns).trouble, 7);
  device.join();
}

TEST(SampleRing, ASampleIsNeverMixedWithAnother) {
  SampleRing ring;
  constexpr std::int64_t samples = 200'000;
  std::thread device([&] {
    for (std::int64_t i = 1; i <= samples; ++i)
      ring.publish({{static_cast<std::uint64_t>(i), 2 * i}, 3 * i, -i});
  });
  std::uint64_t seen = 0;
  while (seen < static_cast<std::uint64_t>(samples)) {
    const RingSample sample = ring.wait_for_another(seen, monotonic_ns() + long_ns);
    const auto number = static_cast<std::int64_t>(sample.when.number);
    ASSERT_GT(sample.when.number, seen);
    ASSERT_EQ(sample.when.time_ns, 2 * number);
    ASSERT_EQ(sample.cart, 3 * number);
    ASSERT_EQ(sample.pendulum, -number);
    seen = sample.when.number;
  }
  device.join();
}

}  // namespace
}  // namespace upright
