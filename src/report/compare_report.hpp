// The page of a comparison: what differs, in words, in a table, and in plots over each other.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "comparison/run_behaviour.hpp"
#include "html.hpp"

namespace upright {

/// "voltage 2.93 V rms -> 0.74 V rms": in the units that people read.
std::string difference_text(const Difference& difference);

/// How a run ended, where it did not stay up: "fell after 3.2 s"; empty where it did.
std::string ending_text(const RunBehaviour& run);

/// What differs between the first run and each other one, the clear differences first: "run B: ...".
std::vector<std::string> comparison_sentences(const std::vector<RunBehaviour>& runs);

/// A, B, ... Z, then the number.
std::string run_letter(std::size_t k);

/// The first few runs over each other: whole, and their last seconds. Throws Error when one cannot be read.
void add_overlays(HtmlPage& page, const std::vector<RunBehaviour>& runs, const std::string& heading);

/// Writes the page. Throws Error when a run cannot be read or the page not be written.
void write_compare_report(const std::vector<RunBehaviour>& runs, const std::filesystem::path& file);

}  // namespace upright
