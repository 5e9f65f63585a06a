// The numbers of a plant file as the data say them: the model that a diagnosis writes, and which numbers of
// the file moved.
#pragma once

#include <vector>

#include "candidates.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// The plant file with the `listed` effects at their fitted values. What moved within what is believed of it
/// (the `nuisances` that are not listed) goes into the numbers that were there.
Plant model_with(const Plant& given, const Plant& fitted, const std::vector<std::size_t>& nuisances,
                 const std::vector<std::size_t>& listed);

/// The numbers of the plant file that differ in the model by more than a thousandth, with the 95 percent
/// interval of what is believed of them. Masses, length and back-EMF include the model's corrections.
std::vector<MovedNumber> moved_numbers(const Plant& given, const Plant& model, const DataRange& range,
                                       const PriorPolicy& prior);

}  // namespace upright
