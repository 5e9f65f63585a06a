#include "doubtful_scales.hpp"

#include <sstream>
#include <utility>

#include "plausibility.hpp"

namespace upright {

namespace {

/// A scale among what was fitted, and how far it may go; else none.
std::pair<double, const FreeParameter*> scale_of(const Hypothesis& known, std::size_t effect) {
  for (const FreeParameter& p : known.free)
    if (p.effect == effect && effect_registry()[effect].parameters[p.index].name == "scale")
      return {known.train.point.plant.find(effect)->values[p.index], &p};
  return {1.0, nullptr};
}

}  // namespace

std::optional<std::string> sentence_on_impossible_scale(const Hypothesis& known,
                                                        const std::vector<std::size_t>& effects) {
  std::optional<std::string> sentence;
  for (const std::size_t effect : effects) {
    const auto [scale, parameter] = scale_of(known, effect);
    if (parameter == nullptr) continue;
    const EndOfRange end = end_of_range(scale, parameter->low, parameter->high);
    if (end == EndOfRange::none) continue;
    std::ostringstream text;
    text.precision(3);
    text << "it takes a " << kind_of(effect) << " of " << scale
         << (end == EndOfRange::low ? " or less" : " or more")
         << ", which cannot be: something else is missing";
    sentence = text.str();
  }
  return sentence;
}

std::vector<std::string> notes_on_doubtful_numbers(const Hypothesis& known,
                                                   const std::vector<std::size_t>& effects,
                                                   const PriorPolicy& policy) {
  std::vector<std::string> notes;
  for (const std::size_t effect : effects) {
    const double scale = scale_of(known, effect).first;
    if (effect_registry()[effect].enters != Enters::parameter || !is_doubtful(scale, policy)) continue;
    std::ostringstream text;
    text.precision(3);
    text << "check " << kind_of(effect) << " another way: " << scale
         << " times what the plant file says is far off; what was found beside it is no more certain";
    notes.push_back(text.str());
  }
  return notes;
}

}  // namespace upright
