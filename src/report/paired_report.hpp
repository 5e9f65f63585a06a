// The comparison of alternating controllers, in sentences and as a page.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "comparison/paired_comparison.hpp"
#include "html.hpp"

namespace upright {

/// How the intervals are computed.
extern const char* const paired_interval_words;

/// "quiet against paper, 5 rounds: cart 3.7 -> 1.8 mm peak to peak, difference -1.9 (-2.5 to -1.3)": falls
/// and clear differences first.
std::vector<std::string> paired_sentences(const PieceComparison& piece);

/// Tables of the differences and of all runs.
void add_paired_tables(HtmlPage& page, const PieceComparison& piece);

/// Writes the page of `upright compare EXPERIMENT`. Throws Error if it cannot be written.
void write_paired_report(const std::filesystem::path& experiment, const std::vector<PieceComparison>& pieces,
                         const std::filesystem::path& file);

}  // namespace upright
