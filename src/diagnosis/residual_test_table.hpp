// The tests of what a fit leaves, as a table: whether it is noise, or something that is not in the model.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "residual_tests.hpp"
#include "selection_policy.hpp"

namespace upright {

/// One sign: a statistic of what is left beyond its threshold.
struct ResidualCondition {
  enum class Beyond { above, below };
  double (*statistic)(const ResidualTests&);
  Beyond beyond;
  double ResidualPolicy::*threshold;

  bool shows(const ResidualTests& tests, const ResidualPolicy& policy) const;
};

/// Something is missing where its sign shows, and the second one too where there is one.
struct ResidualTest {
  std::string_view id;
  ResidualCondition sign;
  std::optional<ResidualCondition> second;
  std::string (*sentence)(const ResidualTests&);

  bool fails(const ResidualTests& tests, const ResidualPolicy& policy) const;
};

/// In the order in which they are asked: the first that fails says what is left.
std::span<const ResidualTest> residual_test_table();

/// The first that fails; null where none does.
const ResidualTest* failed_test(const ResidualTests& tests, const ResidualPolicy& policy);

/// Whether what is left is more than noise, in a sentence, once its excess is known too.
void conclude_tests(ResidualTests& tests, const ResidualPolicy& policy);

}  // namespace upright
