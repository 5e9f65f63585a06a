#include "paired_report.hpp"

#include <algorithm>

#include "base/number_text.hpp"
#include "compare_report.hpp"

namespace upright {

const char* const paired_interval_words =
    "Differences are taken within each round. Their mean has the 95 % confidence interval of the paired "
    "t-test "
    "and is clear if the interval excludes zero. Rounds in which a controller fell are excluded and counted "
    "as "
    "falls.";

namespace {

std::string scaled_text(double value, const Quantity& quantity) {
  return number_text(value * quantity.per_si_unit, 3);
}

std::string difference_words(const PairedDifference& d) {
  const Quantity& quantity = quantities[d.quantity];
  std::string text = scaled_text(d.difference.value, quantity);
  if (d.difference.ci95)
    text += " (" + scaled_text((*d.difference.ci95)[0], quantity) + " to " +
            scaled_text((*d.difference.ci95)[1], quantity) + ")";
  return text;
}

std::string counted(std::size_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

/// One row for each run of the piece.
HtmlTable runs_table(const PieceComparison& piece) {
  HtmlTable table{{"run", "controller", "round", "outcome"}, {}, "Values over the last third of each run."};
  for (const Quantity& quantity : quantities)
    table.header.push_back(std::string(quantity.name) + " [" + std::string(quantity.unit) + "]");
  for (const ComparedRun& run : piece.runs) {
    const std::string ending = ending_text(run.behaviour);
    std::vector<std::string> row = {run.behaviour.name, run.controller, std::to_string(run.round + 1),
                                    ending.empty() ? "stayed up" : ending};
    for (std::size_t k = 0; k < quantities.size(); ++k)
      row.push_back(run.behaviour.behaviour
                        ? scaled_text(run.behaviour.behaviour->values[k].value, quantities[k])
                        : "-");
    table.rows.push_back(row);
  }
  return table;
}

}  // namespace

std::vector<std::string> paired_sentences(const PieceComparison& piece) {
  std::vector<std::string> clear, others;
  if (piece.first_falls > 0)
    clear.push_back(piece.first_controller + " fell in " +
                    counted(static_cast<std::size_t>(piece.first_falls), "run"));
  for (const ControllerComparison& other : piece.others) {
    const std::string who = other.controller + " against " + piece.first_controller + ", " +
                            counted(other.rounds, "round") + ": ";
    if (other.falls > 0)
      clear.push_back(other.controller + " fell in " + counted(static_cast<std::size_t>(other.falls), "run"));
    if (other.rounds == 0) others.push_back(who + "no round in which both stayed up");
    for (const PairedDifference& d : other.differences) {
      const Quantity& quantity = quantities[d.quantity];
      const std::string words = who + std::string(quantity.name) + " " + scaled_text(d.from, quantity) +
                                " -> " + scaled_text(d.to, quantity) + " " + std::string(quantity.unit) +
                                ", difference " + difference_words(d);
      if (d.is_clear())
        clear.push_back(words);
      else
        others.push_back(words + (d.difference.ci95 ? ", not clear" : ", one round gives no interval"));
    }
  }
  clear.insert(clear.end(), others.begin(), others.end());
  return clear;
}

void add_paired_tables(HtmlPage& page, const PieceComparison& piece) {
  HtmlTable table{
      {"quantity", "controller", "rounds", piece.first_controller, "this controller", "difference", "clear"},
      {},
      paired_interval_words};
  for (const ControllerComparison& other : piece.others)
    for (const PairedDifference& d : other.differences) {
      const Quantity& quantity = quantities[d.quantity];
      table.rows.push_back({std::string(quantity.name) + " [" + std::string(quantity.unit) + "]",
                            other.controller, std::to_string(other.rounds), scaled_text(d.from, quantity),
                            scaled_text(d.to, quantity), difference_words(d), d.is_clear() ? "yes" : "no"});
    }
  if (!table.rows.empty()) page.table(table);
  page.table(runs_table(piece));
}

void write_paired_report(const std::filesystem::path& experiment, const std::vector<PieceComparison>& pieces,
                         const std::filesystem::path& file) {
  HtmlPage page("Alternating controllers", experiment.string());
  bool fell = false;
  for (const PieceComparison& piece : pieces)
    fell = fell || std::any_of(piece.runs.begin(), piece.runs.end(),
                               [](const ComparedRun& run) { return run.behaviour.fell; });
  const std::vector<std::string> first = paired_sentences(pieces.front());
  page.answer(fell ? Tone::bad : Tone::neutral, first.empty() ? "Nothing to compare" : first.front(),
              fell ? "A run fell." : "No run fell.");
  for (const PieceComparison& piece : pieces) {
    page.section(piece.label);
    for (const std::string& sentence : paired_sentences(piece)) page.paragraph(sentence);
    add_paired_tables(page, piece);
    std::vector<RunBehaviour> round;
    for (const ComparedRun& run : piece.runs)
      if (run.round == piece.runs.front().round) round.push_back(run.behaviour);
    add_overlays(page, round, "First round, runs overlaid");
  }
  page.write(file);
}

}  // namespace upright
