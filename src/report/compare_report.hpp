// The page of a comparison: the differences in sentences, a table and overlaid plots.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "comparison/run_behaviour.hpp"
#include "html.hpp"

namespace upright {

/// "voltage 2.93 V rms -> 0.74 V rms": in display units.
std::string difference_text(const Difference& difference);

/// How a run ended if it did not stay up: "fell after 3.2 s". Empty if it did.
std::string ending_text(const RunBehaviour& run);

/// The differences between the first run and each other run, clear ones first: "run B: ...".
std::vector<std::string> comparison_sentences(const std::vector<RunBehaviour>& runs);

/// A, B, ... Z, then the number.
std::string run_letter(std::size_t k);

/// Overlays the first few runs: complete, and their last seconds. Throws Error if one cannot be read.
void add_overlays(HtmlPage& page, const std::vector<RunBehaviour>& runs, const std::string& heading);

/// Writes the page. Throws Error if a run cannot be read or the page cannot be written.
void write_compare_report(const std::vector<RunBehaviour>& runs, const std::filesystem::path& file);

}  // namespace upright
