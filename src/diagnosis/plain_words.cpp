#include "plain_words.hpp"

namespace upright {

std::string in_plain_words(std::string sentence) {
  for (const auto& [fixed, plain] : fixed_phrases)
    for (std::size_t at = sentence.find(fixed); at != std::string::npos;
         at = sentence.find(fixed, at + plain.size()))
      sentence.replace(at, fixed.size(), plain);
  return sentence;
}

}  // namespace upright
