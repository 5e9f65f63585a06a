// A disturbance that lasts is not taken for an effect, and an effect is still found beside it.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "blind_case.hpp"
#include "named_effects.hpp"

namespace upright {
namespace {

Plant file_plant() {
  Plant plant;
  plant.cart_mass_kg = 0.815;
  plant.motor = {1.7189, 7.682};
  plant.set("viscous_friction", {3.0});
  return plant;
}

/// Runs of a cart with a random force that lasts for 0.2 s.
std::vector<Measurement> disturbed_runs(Plant plant, unsigned seed, double force_n = 0.15) {
  plant.cart_mass_kg *= 0.99;
  blind::Rig rig{.plant = plant};
  rig.coloured.force_n = force_n;
  rig.coloured.force_time_s = 0.2;
  return three_runs(rig, 4.0, seed);
}

TEST(ColouredNull, ALastingDisturbanceIsNoEffect) {
  for (const unsigned seed : {1, 2, 3, 4, 5, 6})
    EXPECT_EQ(named_effects(disturbed_runs(file_plant(), seed), file_plant()), std::set<std::string>{})
        << seed;
}

/// A force that the model lacks can always be taken for a random one. If that is large, nothing is explained.
TEST(ColouredNull, ALargeDisturbanceIsUnexplained) {
  for (const unsigned seed : {1, 2, 3})
    EXPECT_EQ(diagnose(file_plant(), disturbed_runs(file_plant(), seed, 1.2), {}).verdict,
              Verdict::unexplained)
        << seed;
}

struct NullCase {
  std::uint64_t seed;
  double max_samples;
};

/// Rigs of a laboratory on which nothing is hidden. With white noise alone, a constant force was named on the
/// first, and a sprung mass on the others. It could begin each segment with another swing, even one ten times
/// faster than the cart.
TEST(ColouredNull, ADisturbedRigWithoutAnEffectGetsNone) {
  for (const NullCase& null : {NullCase{blind::seed_of_case(906, 10), blind::Request{}.max_samples},
                               NullCase{blind::seed_of_case(20261211, 327), 6000.0},
                               NullCase{blind::seed_of_case(20270305, 106), 6000.0},
                               NullCase{blind::seed_of_case(20270305, 297), 6000.0}}) {
    blind::Request request = blind::laboratory_request(null.seed);
    request.size = static_cast<blind::Size>(std::mt19937_64(request.seed)() % 3);
    request.max_samples = null.max_samples;
    const blind::Case blind = make_case(request);
    EXPECT_EQ(named_effects(measure_all(blind), blind.believed), std::set<std::string>{}) << null.seed;
  }
}

TEST(ColouredNull, AnEffectIsNamedBesideALastingDisturbance) {
  Plant plant = file_plant();
  plant.set("coulomb_friction", {0.6});
  for (const unsigned seed : {1, 2, 3})
    EXPECT_TRUE(named_effects(disturbed_runs(plant, seed), file_plant()).contains("coulomb_friction"))
        << seed;
}

}  // namespace
}  // namespace upright
