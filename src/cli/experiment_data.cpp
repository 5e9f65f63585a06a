#include "experiment_data.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <set>
#include <string_view>

#include "experiment/experiment.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;

/// A piece that ended otherwise was broken off.
bool ended_by_itself(const std::string& reason) {
  constexpr std::array<std::string_view, 3> ends = {"duration", "fell", "track_limit"};
  return std::find(ends.begin(), ends.end(), reason) != ends.end();
}

/// Fewer than two rows: it ended in its first cycle.
bool never_began(const fs::path& samples) {
  std::ifstream in(samples, std::ios::binary);
  constexpr int header_and_rows = 3;
  std::string line;
  for (int i = 0; i < header_and_rows; ++i)
    if (!std::getline(in, line)) return true;
  return false;
}

/// Why a run that is not among the trials is there.
std::string how_it_ended(const fs::path& run) {
  try {
    const YamlMap document = YamlMap::from_file(run / "run.yaml");
    if (const std::optional<YamlMap> outcome = document.optional_map("outcome"))
      return "its piece was interrupted (" + outcome->text("reason") + ")";
  } catch (const Error&) {
    // What cannot be read was not written to its end.
  }
  return "its piece was interrupted";
}

void add_experiment(const fs::path& folder, NamedRuns& named) {
  std::set<std::string> mentioned;
  const std::size_t before = named.runs.size();
  std::error_code problem;
  // In the order of the trials: names hold the second of the start only, so that sorting them would let the
  // speed of the machine decide the order.
  for (const TrialResult& trial : read_trials(folder)) {
    mentioned.insert(trial.run_directory);
    const fs::path run = folder / trial.run_directory;
    if (!fs::exists(run / "samples.csv", problem)) {
      named.left_out.push_back(run.string() + " is left out: it holds no samples.csv");
    } else if (never_began(run / "samples.csv")) {
      named.left_out.push_back(run.string() + " is left out: its piece never began");
    } else if (!ended_by_itself(trial.reason)) {
      named.left_out.push_back(run.string() + " is left out: its piece was interrupted (" + trial.reason +
                               ")");
    } else {
      named.runs.push_back(run);
    }
  }
  std::set<fs::path> others;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, problem))
    if (!mentioned.contains(entry.path().filename().string()) &&
        fs::exists(entry.path() / "samples.csv", problem))
      others.insert(entry.path());
  for (const fs::path& run : others)
    named.left_out.push_back(
        run.string() +
        " is left out: " + (never_began(run / "samples.csv") ? "its piece never began" : how_it_ended(run)));
  if (named.runs.size() == before)
    throw ConfigError(folder.string() +
                      " holds no completed piece: start its experiment again to continue it");
}

}  // namespace

NamedRuns runs_named(const std::vector<std::string>& data) {
  NamedRuns named;
  for (const std::string& item : data) {
    std::error_code problem;
    if (fs::exists(fs::path(item) / "trials.csv", problem)) {
      add_experiment(item, named);
    } else {
      named.runs.emplace_back(item);
    }
  }
  return named;
}

}  // namespace upright::cli
