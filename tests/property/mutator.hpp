// Mutants of input files: what a slip of the pen, a bad disk or an ill-meaning sender makes of a good one.
#pragma once

#include <random>
#include <string>
#include <vector>

namespace upright::testing {

/// Makes mutants of the texts of one kind of file. The same seed makes the same mutant.
class Mutator {
 public:
  explicit Mutator(std::vector<std::string> good_texts) : texts_(std::move(good_texts)) {}

  /// One of the texts, with one to four changes: of a number to the ends of what there is, of a word to
  /// another word of its kind, of a value to a list, a map, nothing or deep nesting; a line or an entry left
  /// out, doubled or taken from another file; or of bytes.
  std::string mutant(std::uint64_t seed) const;

 private:
  std::vector<std::string> texts_;
};

}  // namespace upright::testing
