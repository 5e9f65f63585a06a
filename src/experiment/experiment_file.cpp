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
constexpr std::size_t longest_name = 60;

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

Experiment read(const YamlMap& document, std::string text) {
  const YamlMap map = document.map("experiment");
  Experiment experiment;
  experiment.name = map.text("name");
  if (!is_plain_name(experiment.name, longest_name))
    map.fail("name", "is '" + experiment.name.substr(0, 60) + "'",
             "the name is used for folders, so use at most 60 lower-case letters, digits, '-' and '_'");
  experiment.why = map.text("why");
  if (map.has("plant")) experiment.plant = map.path("plant");
  if (map.has("gains")) experiment.gains = map.path("gains");
  if (map.has("sample_rate_hz"))
    experiment.sample_rate_hz =
        map.number("sample_rate_hz", Range::within(lowest_sample_rate_hz, highest_sample_rate_hz));
  experiment.travel_m = map.number("travel_m", Range::within(shortest_travel_m, longest_travel_m));
  experiment.voltage_limit_v = map.number("voltage_limit_v", any_voltage);
  std::set<std::string> labels;
  double total_s = 0.0;
  for (const YamlMap& item : map.maps("pieces")) {
    Piece piece = read_piece(item);
    if (balances(piece) && !compares(piece) && experiment.gains.empty())
      item.fail("kind", "needs gains to balance with, and the experiment names none",
                "add 'gains: FILE' with a gain file to the experiment");
    const std::string label = piece.label;
    for (int i = 2; labels.contains(piece.label); ++i) piece.label = label + "-" + std::to_string(i);
    labels.insert(piece.label);
    refuse_voltages_above(experiment.voltage_limit_v, *piece.kind, item);
    piece.kind->refuse_beyond(experiment.travel_m, item);
    refuse_long_times(item, *piece.kind, total_s);
    experiment.pieces.push_back(std::move(piece));
  }
  if (experiment.pieces.empty() || experiment.pieces.size() > 100)
    map.fail("pieces", "has " + std::to_string(experiment.pieces.size()) + " entries",
             "list 1 to 100 pieces");
  map.finish();
  document.finish();
  experiment.text = std::move(text);
  experiment.source = map;
  return experiment;
}

}  // namespace

Experiment read_experiment_text(const std::string& text, const std::filesystem::path& file) {
  return read(YamlMap::from_text(text, file), text);
}

Experiment read_experiment_file(const std::filesystem::path& file) {
  // Read once: what was checked is what is kept.
  return read_experiment_text(whole_file(file), file);
}

}  // namespace upright
