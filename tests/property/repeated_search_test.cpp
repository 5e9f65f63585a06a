// The search with other runs held out, where the first one leaves something.
#include <gtest/gtest.h>

#include <set>

#include "blind_case.hpp"
#include "named_effects.hpp"

namespace upright {
namespace {

// A record of 2.9 s. Its middle part, held out first, shows next to nothing alone: the search that is trained
// on it names no effect.
TEST(RepeatedSearch, KeepsWhatAllOfAShortRecordShows) {
  blind::Request request =
      blind::laboratory_request(blind::seed_of_case(20261225, 55), {"pivot_quadratic_drag"});
  request.size = blind::Size::strong;
  request.max_samples = 6000.0;
  const blind::Case blind = make_case(request);
  EXPECT_EQ(named_effects(measure_all(blind), blind.believed), std::set<std::string>{"pivot_quadratic_drag"});
}

}  // namespace
}  // namespace upright
