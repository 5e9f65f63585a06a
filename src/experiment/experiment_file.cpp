#include "experiment_file.hpp"

#include <cmath>
#include <set>

#include "base/input_file.hpp"
#include "upright/base/error.hpp"
#include "upright/control/gain_file.hpp"

namespace upright {

namespace {

constexpr double longest_experiment_s = 86400.0;  // longer ones are a slip of the pen
constexpr double shortest_travel_m = 0.03;  // the cart comes to rest within about 1 cm of where it should
constexpr std::size_t max_pieces = 100;

/// Refuses what nobody can have meant. `total_s`: of the pieces before; this one's time is added.
void refuse_long_times(const YamlMap& item, const PieceKind& kind, double& total_s) {
  const PieceTime time = kind.time();
  if (time.duration_s > longest_piece_s)
    item.fail(time.key, "makes the piece last " + exact_text(std::ceil(time.duration_s)) + " s",
              "make the piece shorter than " + exact_text(longest_piece_s) + " s");
  total_s += kind.runs() * time.duration_s;
  if (total_s > longest_experiment_s)
    item.fail(time.key, "makes the experiment last longer than a day", "shorten it, or split the file");
}

/// The pieces so far, for what they must not have in common.
struct PiecesSoFar {
  std::set<std::string> labels;
  double total_s = 0.0;
};

void item_keys(PieceKeys& item, Experiment& experiment, PiecesSoFar& before) {
  Piece piece;
  piece_keys(item, piece);
  item.needs("kind", !balances(piece) || compares(piece) || !experiment.gains.empty(),
             "needs gains to balance with, and the experiment names none",
             "add 'gains: FILE' with a gain file to the experiment");
  const std::string label = piece.label;
  for (int i = 2; before.labels.contains(piece.label); ++i) piece.label = label + "-" + std::to_string(i);
  before.labels.insert(piece.label);
  if (const YamlMap* map = item.source()) {
    refuse_voltages_above(experiment.voltage_limit_v, *piece.kind, *map);
    piece.kind->refuse_beyond(experiment.travel_m, *map);
    refuse_long_times(*map, *piece.kind, before.total_s);
  }
  experiment.pieces.push_back(std::move(piece));
}

void keys_of_experiment(PieceKeys& keys, Experiment& experiment) {
  keys.name("name", experiment.name, required);
  keys.text("why", experiment.why);
  keys.optional_path("plant", experiment.plant);
  if (keys.decides_by_presence("gains", !experiment.gains.empty()))
    keys.path("gains", experiment.gains);
  else
    experiment.gains.clear();
  if (keys.given("sample_rate_hz", experiment.sample_rate_hz > 0.0))
    keys.number("sample_rate_hz", experiment.sample_rate_hz,
                Range::within(lowest_sample_rate_hz, highest_sample_rate_hz));
  keys.number("travel_m", experiment.travel_m, Range::within(shortest_travel_m, longest_travel_m));
  keys.number("voltage_limit_v", experiment.voltage_limit_v, any_voltage);
  PiecesSoFar before;
  keys.piece_maps("pieces", [&](PieceKeys& item, std::size_t) { item_keys(item, experiment, before); });
  const std::size_t count = experiment.pieces.size();
  keys.check_size("pieces", count, 1, max_pieces, "has " + std::to_string(count) + " entries",
                  "list 1 to 100 pieces");
  if (const YamlMap* map = keys.source()) experiment.source = *map;
}

Experiment read(const YamlMap& document, std::string text) {
  Experiment experiment;
  read_piece_keys(document, [&](PieceKeys& keys) { experiment_keys(keys, experiment); });
  document.finish();
  experiment.text = std::move(text);
  return experiment;
}

}  // namespace

void experiment_keys(PieceKeys& document, Experiment& experiment) {
  document.piece_map("experiment", [&](PieceKeys& keys) { keys_of_experiment(keys, experiment); });
}

Experiment read_experiment_text(const std::string& text, const std::filesystem::path& file) {
  return read(YamlMap::from_text(text, file), text);
}

Experiment read_experiment_file(const std::filesystem::path& file) {
  // Read once: what was checked is what is kept.
  return read_experiment_text(whole_file(file), file);
}

}  // namespace upright
