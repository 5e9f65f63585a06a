// A reading that is worth something, for tests of links that take a moment to begin.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "upright/hal/rig.hpp"

namespace upright::test {

inline RigReading fresh_reading(Rig& rig) {
  for (int i = 0; i < 100; ++i) {
    const RigReading reading = rig.read();
    if (reading.status == RigStatus::fresh) return reading;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ADD_FAILURE() << "no fresh reading";
  return {};
}

}  // namespace upright::test
