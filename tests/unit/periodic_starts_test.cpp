// Fits of effects that are periodic along the track start at the pitch and phase that the residual has.
#include "diagnosis/periodic_starts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "diagnosis/candidates.hpp"
#include "diagnosis/phases.hpp"

namespace upright {
namespace {

constexpr double pitch_m = 0.037, phase_rad = 0.8, size = 0.15;

/// Residuals along 0.4 m of track, with a motor that pushes either way.
std::vector<PlaceForce> residual_with(double cogging_n, double ripple) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place_m(-0.1, 0.3), push_n(-3.0, 3.0);
  std::normal_distribution<double> noise_n(0.0, 0.02);
  std::vector<PlaceForce> residual;
  for (int i = 0; i < 3000; ++i) {
    const double x = place_m(random), unit_n = push_n(random);
    const double wave = std::sin(2.0 * std::numbers::pi * x / pitch_m + phase_rad);
    // A motor that is a tenth too strong everywhere, and a constant force: neither has a period.
    const double even_n = 0.1 * unit_n + 0.2;
    residual.push_back({x, even_n + (cogging_n + ripple * unit_n) * wave + noise_n(random), unit_n, 0.0});
  }
  return residual;
}

std::vector<std::vector<double>> starts_of(std::size_t effect, const std::vector<PlaceForce>& residual) {
  DataRange range;
  range.cart_low_m = -0.1;
  range.cart_high_m = 0.3;
  range.longest_travel_m = 0.4;
  return periodic_starts(effect, residual, range, PriorPolicy{}, SearchBudget{});
}

std::vector<double> first_start(std::size_t effect, const std::vector<PlaceForce>& residual) {
  return starts_of(effect, residual).front();
}

void expect_found(std::size_t effect, const std::vector<PlaceForce>& residual) {
  const std::vector<double> start = first_start(effect, residual);
  ASSERT_EQ(start.size(), 3u);
  EXPECT_NEAR(start[0], size, 0.1 * size);
  EXPECT_NEAR(start[1], pitch_m, 0.02 * pitch_m);
  // The phase goes with the pitch: the wave itself is right in the middle of the track.
  constexpr double middle_m = 0.1;
  const auto turn = [&](double pitch, double phase) {
    return 2.0 * std::numbers::pi * middle_m / pitch + phase;
  };
  EXPECT_NEAR(std::remainder(turn(start[1], start[2]) - turn(pitch_m, phase_rad), 2.0 * std::numbers::pi),
              0.0, 0.2);
}

TEST(PeriodicStarts, CoggingIsFoundBesideAMotorOfAnySign) {
  expect_found(effect_number("cogging_force"), residual_with(size, 0.0));
}

TEST(PeriodicStarts, TorqueRippleIsFoundThoughItsForceChangesSign) {
  expect_found(effect_number("torque_ripple"), residual_with(0.0, size));
}

// What an encoder shows of a cart that moves at even speed: its second derivative is taken for a force.
TEST(PeriodicStarts, EccentricEncoderIsFoundInTheForceItShows) {
  constexpr double mass_kg = 0.8, waves_per_m = 2.0 * std::numbers::pi / pitch_m;
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> place_m(-0.1, 0.3), speed_mps(-0.5, 0.5);
  std::normal_distribution<double> noise_n(0.0, 0.02);
  std::vector<PlaceForce> residual;
  for (int i = 0; i < 3000; ++i) {
    const double x = place_m(random), v = speed_mps(random);
    const double shown_mps2 = -size * waves_per_m * v * v * std::sin(waves_per_m * x + phase_rad);
    residual.push_back({x, 0.2 + mass_kg * shown_mps2 + noise_n(random), 1.0, mass_kg * v * v});
  }
  expect_found(effect_number("encoder_eccentricity"), residual);
}

// The steps of an encoder make many pitches of a few steps look likely.
TEST(PeriodicStarts, OthersAreTriedBesideManyShortPitches) {
  std::vector<PlaceForce> residual = residual_with(size, 0.0);
  for (PlaceForce& at : residual)
    for (int i = 0; i < 8; ++i)
      at.force_n += 2.0 * size * std::sin(2.0 * std::numbers::pi * at.cart_m * (900.0 + 5.0 * i) + i);
  const auto starts = starts_of(effect_number("cogging_force"), residual);
  EXPECT_NEAR(starts.front()[1], 1e-3, 2e-4);
  EXPECT_TRUE(std::ranges::any_of(starts, [](const std::vector<double>& start) {
    return std::abs(start[1] - pitch_m) < 0.02 * pitch_m;
  }));
}

TEST(PeriodicStarts, FewSamplesStartAnywhere) {
  std::vector<PlaceForce> few = residual_with(size, 0.0);
  few.resize(10);
  const ParameterInfo& share = effect_registry()[effect_number("torque_ripple")].parameters[0];
  EXPECT_EQ(first_start(effect_number("torque_ripple"), few)[0], share.typical);
}

TEST(Pitch, IsOpenWhereItMayBeTheLongest) {
  const auto interval = [](double high_m) {
    ParameterEstimate pitch;
    pitch.name = "pitch_m";
    pitch.high = high_m;
    return std::vector<ParameterEstimate>{pitch};
  };
  EXPECT_FALSE(is_pitch_open(interval(0.0099), 0.01));
  EXPECT_TRUE(is_pitch_open(interval(0.01), 0.01));
  EXPECT_TRUE(is_pitch_open(interval(0.02), 0.01));
  EXPECT_FALSE(is_pitch_open({}, 0.01));
}

TEST(PeriodicStarts, EffectsWithAPitchArePeriodic) {
  EXPECT_TRUE(is_periodic(effect_number("cogging_force")));
  EXPECT_TRUE(is_periodic(effect_number("torque_ripple")));
  EXPECT_TRUE(is_periodic(effect_number("encoder_eccentricity")));
  EXPECT_FALSE(is_periodic(effect_number("cable_spring")));
}

}  // namespace
}  // namespace upright
