#include "hal/guarded_rig.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

namespace upright {
namespace {

/// Gives the readings of a list, 1 ms apart; stays at the last.
class ListedRig final : public Rig {
 public:
  explicit ListedRig(std::vector<std::int64_t> cart) : cart_(std::move(cart)) {}
  void open() override { next_ = 0; }
  RigReading read() noexcept override {
    RigReading reading;
    reading.cart_counts = cart_[std::min(next_, cart_.size() - 1)];
    reading.time_ns = static_cast<std::int64_t>(++next_) * 1'000'000;
    reading.sequence = next_;
    reading.status = RigStatus::fresh;
    return reading;
  }
  RigFault write(double) noexcept override { return RigFault::none; }
  StopReport stop() noexcept override { return at_zero_volts(); }

 private:
  std::vector<std::int64_t> cart_;
  std::size_t next_ = 0;
};

Calibration ip02() {
  Calibration calibration;
  calibration.cart = {2.27485e-5, 1, 16, 5.0};  // 220 counts in a millisecond at most
  calibration.pendulum = {1.534e-3, 1, 16, 60.0};
  return calibration;
}

TEST(GuardedRig, LetsEveryPossibleMotionThrough) {
  const auto rig =
      guarded(std::make_unique<ListedRig>(std::vector<std::int64_t>{32700, 32767, -32600, -32500}), ip02());
  rig->open();
  for (const std::int64_t counts : {32700, 32767, -32600, -32500}) {
    const RigReading reading = rig->read();
    EXPECT_EQ(reading.status, RigStatus::fresh);
    EXPECT_EQ(reading.cart_counts, counts) << "a wrap is no jump";
  }
}

TEST(GuardedRig, RefusesASingleJumpAndGoesOn) {
  const auto rig =
      guarded(std::make_unique<ListedRig>(std::vector<std::int64_t>{0, 5000, 5000, 10, 5000}), ip02());
  rig->open();
  EXPECT_EQ(rig->read().status, RigStatus::fresh);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(rig->read().fault, RigFault::corrupt_reply);
  EXPECT_EQ(rig->read().status, RigStatus::fresh);
  EXPECT_EQ(rig->read().fault, RigFault::corrupt_reply) << "it counts anew";
}

TEST(GuardedRig, GivesUpJumpedCountsUntilItIsOpenedAgain) {
  const auto rig =
      guarded(std::make_unique<ListedRig>(std::vector<std::int64_t>{0, 5000, 5000, 5000, 0}), ip02());
  rig->open();
  EXPECT_EQ(rig->read().status, RigStatus::fresh);
  rig->read();
  rig->read();
  EXPECT_EQ(rig->read().fault, RigFault::counts_jumped);
  EXPECT_EQ(rig->read().fault, RigFault::counts_jumped) << "also when the counts are back";
  rig->open();
  EXPECT_EQ(rig->read().status, RigStatus::fresh);
}

TEST(GuardedRig, LetsAHandMoveTheRigWhileItIsOpen) {
  const auto rig = guarded(std::make_unique<ListedRig>(std::vector<std::int64_t>{0, 5000, 5010}), ip02());
  rig->open();
  EXPECT_EQ(rig->read().status, RigStatus::fresh);
  rig->moved_by_hand();
  for (int i = 0; i < 2; ++i) EXPECT_EQ(rig->read().status, RigStatus::fresh);
}

}  // namespace
}  // namespace upright
