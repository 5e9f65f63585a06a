#include "base/work_queue.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <stdexcept>
#include <string>

namespace upright {
namespace {

TEST(WorkQueue, HandsOutEachNumberOnceOverSeveralThreads) {
  constexpr std::size_t count = 1000;
  WorkQueue queue(count);
  std::array<std::atomic<int>, count> handed_out{};
  on_threads(4, [&] {
    while (const auto number = queue.next()) ++handed_out[*number];
  });
  for (const auto& times : handed_out) EXPECT_EQ(times, 1);
  EXPECT_TRUE(queue.is_over());
  EXPECT_NO_THROW(queue.rethrow());
}

TEST(WorkQueue, EndsWithAFailureAndKeepsThatOfTheLowestNumber) {
  WorkQueue queue(10);
  for (std::size_t taken = 0; taken < 4; ++taken) queue.next();
  for (const std::size_t failing : {std::size_t{3}, std::size_t{1}, std::size_t{2}})
    queue.guard(failing, [&] { throw std::runtime_error(std::to_string(failing)); });
  EXPECT_FALSE(queue.next());
  EXPECT_TRUE(queue.is_over());
  try {
    queue.rethrow();
    ADD_FAILURE();
  } catch (const std::runtime_error& failure) {
    EXPECT_STREQ(failure.what(), "1");
  }
}

TEST(WorkQueue, HandsOutNothingOnceItIsStopped) {
  bool stopped = false;
  WorkQueue queue(10, [&] { return stopped; });
  EXPECT_EQ(queue.next(), 0u);
  stopped = true;
  EXPECT_FALSE(queue.next());
  EXPECT_TRUE(queue.is_over());
}

}  // namespace
}  // namespace upright
