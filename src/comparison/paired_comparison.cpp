#include "paired_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "experiment/experiment.hpp"
#include "student.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

namespace fs = std::filesystem;

/// The run of a controller in a round; null: it was not made.
const ComparedRun* run_of(const std::vector<ComparedRun>& runs, const std::string& controller, int round) {
  const auto at = std::find_if(runs.begin(), runs.end(), [&](const ComparedRun& run) {
    return run.controller == controller && run.round == round;
  });
  return at == runs.end() ? nullptr : &*at;
}

/// What a fall does to the last third is no behaviour to compare.
bool stayed_up(const ComparedRun* run) {
  return run != nullptr && !run->behaviour.fell && run->behaviour.behaviour.has_value();
}

int falls_of(const std::vector<ComparedRun>& runs, const std::string& controller) {
  return static_cast<int>(std::count_if(runs.begin(), runs.end(), [&](const ComparedRun& run) {
    return run.controller == controller && run.behaviour.fell;
  }));
}

using Pairs = std::vector<std::pair<const Behaviour*, const Behaviour*>>;

Pairs pairs_of(const std::vector<ComparedRun>& runs, const std::string& first, const std::string& other) {
  Pairs pairs;
  for (const ComparedRun& run : runs) {
    if (run.controller != first) continue;
    const ComparedRun* partner = run_of(runs, other, run.round);
    if (stayed_up(&run) && stayed_up(partner))
      pairs.emplace_back(&*run.behaviour.behaviour, &*partner->behaviour.behaviour);
  }
  return pairs;
}

PairedDifference difference_in(const Pairs& pairs, std::size_t quantity) {
  PairedDifference result;
  result.quantity = quantity;
  std::vector<double> differences;
  for (const auto& [before, after] : pairs) {
    const double from = before->values[quantity].value, to = after->values[quantity].value;
    result.from += from / static_cast<double>(pairs.size());
    result.to += to / static_cast<double>(pairs.size());
    differences.push_back(to - from);
  }
  result.difference = paired_difference(differences);
  return result;
}

/// The folder of a trial's run: within the experiment's, so that one from somebody else leads nowhere else.
fs::path run_within(const fs::path& folder, const std::string& name) {
  if (name.empty() || name == "." || name == ".." || fs::path(name).filename() != name)
    throw ConfigError((folder / "trials.csv").string() + " contains a run outside its folder, " + name +
                      ": remove that line");
  return folder / name;
}

}  // namespace

bool PairedDifference::is_clear() const {
  return difference.ci95 && (*difference.ci95)[0] * (*difference.ci95)[1] > 0.0;
}

Estimate paired_difference(const std::vector<double>& differences) {
  const auto count = static_cast<double>(differences.size());
  Estimate estimate;
  for (const double d : differences) estimate.value += d / count;
  if (differences.size() < 2) return estimate;
  double squares = 0.0;
  for (const double d : differences) squares += (d - estimate.value) * (d - estimate.value);
  const double half = student_quantile(differences.size() - 1) * std::sqrt(squares / (count - 1.0) / count);
  estimate.ci95 = {estimate.value - half, estimate.value + half};
  return estimate;
}

PieceComparison compare_in_rounds(std::string label, std::vector<ComparedRun> runs) {
  PieceComparison result;
  result.label = std::move(label);
  result.runs = std::move(runs);
  std::vector<std::string> names;
  for (const ComparedRun& run : result.runs)
    if (std::find(names.begin(), names.end(), run.controller) == names.end()) names.push_back(run.controller);
  if (names.empty()) return result;
  result.first_controller = names.front();
  result.first_falls = falls_of(result.runs, names.front());
  for (std::size_t i = 1; i < names.size(); ++i) {
    const Pairs pairs = pairs_of(result.runs, names.front(), names[i]);
    ControllerComparison comparison{names[i], pairs.size(), falls_of(result.runs, names[i]), {}};
    for (std::size_t k = 0; k < quantities.size() && !pairs.empty(); ++k)
      comparison.differences.push_back(difference_in(pairs, k));
    result.others.push_back(std::move(comparison));
  }
  return result;
}

bool holds_experiment(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / "experiment.yaml", ignored) && fs::exists(folder / "trials.csv", ignored);
}

std::vector<PieceComparison> paired_comparisons(const fs::path& folder) {
  std::vector<Piece> pieces;
  for (const YamlMap& piece : YamlMap::from_file(folder / "experiment.yaml").maps("pieces"))
    pieces.push_back(read_piece(piece));
  const std::vector<TrialResult> trials = read_trials(folder, pieces);
  std::vector<PieceComparison> comparisons;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (!compares(pieces[i])) continue;
    std::vector<ComparedRun> runs;
    for (const TrialResult& trial : trials)
      if (trial.trial.piece == i)
        runs.push_back({trial.controller, trial.trial.repeat,
                        behaviour_of_run(run_within(folder, trial.run_directory))});
    if (!runs.empty()) comparisons.push_back(compare_in_rounds(pieces[i].label, std::move(runs)));
  }
  return comparisons;
}

}  // namespace upright
