// The kernel's simulated chip does what the other tests rely on.
#include "gpio_sim.hpp"

#include <gtest/gtest.h>

namespace upright::test {
namespace {

TEST(GpioSim, AnUnusedLineFollowsItsPull) {
  GpioSim sim("plain", 2);
  EXPECT_TRUE(std::filesystem::exists("/dev/" + sim.chip()));
  for (const bool high : {true, false, true}) {
    sim.pull(1, high);
    EXPECT_EQ(sim.level(1), high);
    EXPECT_FALSE(sim.level(0));
  }
}

}  // namespace
}  // namespace upright::test
