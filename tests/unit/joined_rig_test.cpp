// Joined rigs: what a reading of several parts is worth, in which order they are served, and that all stop.
#include "../../hal/joined_rig.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "upright/base/error.hpp"

namespace upright {
namespace {

constexpr double period_s = 0.001;
constexpr std::int64_t period_ns = 1'000'000;
constexpr RigRoles both_encoders{true, true, false};
constexpr RigRoles cart_only{true, false, false};
constexpr RigRoles pendulum_only{false, true, false};
constexpr RigRoles output_only{false, false, true};

/// What a test sets and what it then sees of a part.
struct Script {
  std::string name;
  RigReading next;
  RigFault write_fault = RigFault::none;
  bool opens = true;
  double last_v = -1.0;
  std::vector<std::string>* story = nullptr;
  StopReport stop = at_zero_volts();
  std::uint64_t samples = 0;  ///< it is the clock where there are some
};

class ScriptedRig final : public Rig {
 public:
  explicit ScriptedRig(Script& script) : script_(script) {}
  void open() override {
    tell("open");
    if (!script_.opens) throw DeviceError("plug it in");
  }
  RigReading read() noexcept override {
    tell("read");
    return script_.next;
  }
  RigFault write(double voltage_v) noexcept override {
    tell("write");
    script_.last_v = voltage_v;
    return script_.write_fault;
  }
  StopReport stop() noexcept override {
    tell("stop");
    return script_.stop;
  }
  bool is_clock() const noexcept override { return script_.samples > 0; }
  DeviceSample wait_next(std::int64_t until_ns) noexcept override { return {script_.samples, until_ns}; }

 private:
  void tell(const char* what) const { script_.story->push_back(script_.name + " " + what); }
  Script& script_;
};

class JoinedRigTest : public testing::Test {
 protected:
  JoinedRigTest() {
    for (Script* script : {&cart, &pendulum, &output}) {
      script->story = &story;
      script->next.status = RigStatus::fresh;
      script->next.time_ns = 10 * period_ns;
      script->next.sequence = 1;
    }
    cart.next.cart_counts = 11;
    cart.next.pendulum_counts = -1;
    pendulum.next.cart_counts = -2;
    pendulum.next.pendulum_counts = 22;
    output.next.cart_counts = output.next.pendulum_counts = -3;
  }

  std::unique_ptr<Rig> three() {
    std::vector<RigPart> parts;
    parts.push_back({std::make_unique<ScriptedRig>(cart), cart_only});
    parts.push_back({std::make_unique<ScriptedRig>(pendulum), pendulum_only});
    parts.push_back({std::make_unique<ScriptedRig>(output), output_only});
    return joined(std::move(parts), period_s);
  }
  /// The next readings of all parts are new ones.
  void count_on() {
    for (Script* script : {&cart, &pendulum, &output}) ++script->next.sequence;
  }

  std::vector<std::string> story;
  Script cart{"cart", {}, RigFault::none, true, -1.0, nullptr};
  Script pendulum{"pendulum", {}, RigFault::none, true, -1.0, nullptr};
  Script output{"output", {}, RigFault::none, true, -1.0, nullptr};
};

TEST_F(JoinedRigTest, FollowsThePartWhoseDeviceIsTheClock) {
  const auto rig = three();
  rig->open();
  EXPECT_FALSE(rig->is_clock());
  EXPECT_EQ(rig->wait_next(5).number, 0u);
  pendulum.samples = 7;
  EXPECT_TRUE(rig->is_clock());
  EXPECT_EQ(rig->wait_next(5).number, 7u);
  EXPECT_EQ(rig->wait_next(5).time_ns, 5);
}

TEST_F(JoinedRigTest, TakesEachCountFromItsPartAndTheOlderTime) {
  const auto rig = three();
  rig->open();
  pendulum.next.time_ns -= period_ns / 4;
  output.next.time_ns = 0;
  cart.next.recoveries = 1;
  output.next.recoveries = 2;
  const RigReading reading = rig->read();
  EXPECT_EQ(reading.recoveries, 3u) << "of all links together";
  EXPECT_EQ(reading.status, RigStatus::fresh);
  EXPECT_EQ(reading.cart_counts, 11);
  EXPECT_EQ(reading.pendulum_counts, 22);
  EXPECT_EQ(reading.time_ns, 10 * period_ns - period_ns / 4);
  count_on();
  EXPECT_EQ(rig->read().sequence, reading.sequence + 1);
}

TEST_F(JoinedRigTest, ServesTheOutputFirstAndReadsEveryPart) {
  const auto rig = three();
  rig->open();
  cart.next.status = output.next.status = RigStatus::fault;
  rig->read();
  EXPECT_EQ(rig->write(2.5), RigFault::none);
  rig->stop();
  EXPECT_EQ(story, (std::vector<std::string>{"output open", "cart open", "pendulum open", "output read",
                                             "cart read", "pendulum read", "output write", "output stop",
                                             "cart stop", "pendulum stop"}));
  EXPECT_EQ(output.last_v, 2.5);
  EXPECT_EQ(cart.last_v, -1.0) << "only the output is given a voltage";
}

TEST_F(JoinedRigTest, StopsAllPartsAndKnowsWhatItsOutputKnows) {
  const auto rig = three();
  rig->open();
  output.stop = {};
  EXPECT_FALSE(rig->stop().zero_confirmed);
  output.stop = at_zero_volts();
  cart.stop = {};
  EXPECT_TRUE(rig->stop().done());
  EXPECT_EQ(std::count(story.begin(), story.end(), "pendulum stop"), 2);
}

TEST_F(JoinedRigTest, IsWorthWhatItsWorstPartIsWorth) {
  const auto rig = three();
  rig->open();
  for (Script* script : {&cart, &pendulum, &output}) {
    count_on();
    script->next.status = RigStatus::stale;
    script->next.fault = RigFault::link_timeout;
    EXPECT_EQ(rig->read().status, RigStatus::stale) << script->name;
    count_on();
    script->next.status = RigStatus::fault;
    script->next.fault = RigFault::link_lost;
    const RigReading reading = rig->read();
    EXPECT_EQ(reading.status, RigStatus::fault) << script->name;
    EXPECT_EQ(reading.fault, RigFault::link_lost) << script->name;
    script->next.status = RigStatus::fresh;
    script->next.fault = RigFault::none;
    count_on();
    EXPECT_EQ(rig->read().status, RigStatus::fresh) << script->name;
  }
}

TEST_F(JoinedRigTest, NamesTheFaultThatDoesNotPass) {
  const auto rig = three();
  rig->open();
  output.next.status = pendulum.next.status = RigStatus::fault;
  output.next.fault = RigFault::link_timeout;
  pendulum.next.fault = RigFault::device_restarted;
  EXPECT_EQ(rig->read().fault, RigFault::device_restarted);
  output.next.fault = RigFault::device_restarted;
  pendulum.next.fault = RigFault::link_timeout;
  EXPECT_EQ(rig->read().fault, RigFault::device_restarted);
}

TEST_F(JoinedRigTest, DoesNotBelieveAPartThatRepeatsItsCounts) {
  const auto rig = three();
  rig->open();
  EXPECT_EQ(rig->read().status, RigStatus::fresh);
  count_on();
  --pendulum.next.sequence;
  EXPECT_EQ(rig->read().status, RigStatus::stale);
}

TEST_F(JoinedRigTest, DoesNotJoinCountsTakenTooFarApart) {
  const auto rig = three();
  rig->open();
  cart.next.time_ns = pendulum.next.time_ns - period_ns / 2;
  EXPECT_EQ(rig->read().status, RigStatus::fresh);
  for (const std::int64_t skew_ns : {-period_ns / 2 - 1, period_ns / 2 + 1}) {
    count_on();
    cart.next.time_ns = pendulum.next.time_ns + skew_ns;
    const RigReading reading = rig->read();
    EXPECT_EQ(reading.status, RigStatus::stale) << skew_ns;
    EXPECT_EQ(reading.fault, RigFault::link_timeout);
  }
}

TEST_F(JoinedRigTest, ShowsTheOutputsFaultWhenWriting) {
  const auto rig = three();
  rig->open();
  output.write_fault = RigFault::link_lost;
  EXPECT_EQ(rig->write(1.0), RigFault::link_lost);
}

TEST_F(JoinedRigTest, StopsWhatWasOpenWhenAPartDoesNotOpen) {
  const auto rig = three();
  pendulum.opens = false;
  EXPECT_THROW(rig->open(), DeviceError);
  EXPECT_EQ(story, (std::vector<std::string>{"output open", "cart open", "pendulum open", "output stop",
                                             "cart stop", "pendulum stop"}));
}

TEST_F(JoinedRigTest, ReadsAPartWithTwoRolesOnce) {
  std::vector<RigPart> parts;
  parts.push_back({std::make_unique<ScriptedRig>(cart), both_encoders});
  parts.push_back({std::make_unique<ScriptedRig>(output), output_only});
  const auto rig = joined(std::move(parts), period_s);
  rig->open();
  const RigReading reading = rig->read();
  EXPECT_EQ(reading.status, RigStatus::fresh);
  EXPECT_EQ(reading.pendulum_counts, -1);
  EXPECT_EQ(story, (std::vector<std::string>{"output open", "cart open", "output read", "cart read"}));
}

}  // namespace
}  // namespace upright
