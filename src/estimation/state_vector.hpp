// The estimated state of a plant as an array, in the order of LinearStep.
#pragma once

#include <array>

#include "linear_step.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

constexpr int state_count = LinearStep::states;

template <class S>
std::array<S*, state_count> as_array(PlantState<S>& s) {
  return {&s.cart_m, &s.theta_rad, &s.cart_mps, &s.theta_radps, &s.bristle_m};
}

}  // namespace upright
