#include "import_proposal.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "csv_reader.hpp"
#include "dataset_file.hpp"
#include "mat_file.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

namespace {

namespace fs = std::filesystem;

/// How people name a quantity. The earlier word is the surer one.
struct NamesOfQuantity {
  std::string_view quantity;
  std::array<std::string_view, 14> words;
};

constexpr std::array names_of_quantities = {
    NamesOfQuantity{"time_s",
                    {"time", "t", "zeit", "tout", "timestamp", "elapsed", "seconds", "sec", "clock"}},
    NamesOfQuantity{"voltage_v",
                    {"voltage", "volt", "volts", "spannung", "u", "vm", "vin", "vir", "command", "cmd",
                     "input", "motor", "drive", "v"}},
    NamesOfQuantity{"theta_rad",
                    {"theta", "angle", "pendulum", "winkel", "alpha", "phi", "th", "pend", "angular"}},
    NamesOfQuantity{
        "cart_m",
        {"cart", "x", "position", "pos", "weg", "xc", "displacement", "wagen", "qm", "q", "track", "y"}},
};

/// The words of a name: `out.Theta_deg` has out, theta and deg; without what stands in brackets.
std::vector<std::string> words_of(std::string_view name) {
  if (!unit_in_name(name).empty()) name = name.substr(0, name.find_last_of("[("));
  std::vector<std::string> words(1);
  char before = ' ';
  for (const char c : name) {
    const bool letter = std::isalpha(static_cast<unsigned char>(c)) != 0;
    const bool new_word = std::isupper(static_cast<unsigned char>(c)) != 0 &&
                          std::islower(static_cast<unsigned char>(before)) != 0;
    if ((!letter || new_word) && !words.back().empty()) words.emplace_back();
    if (letter) words.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    before = c;
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

/// The unit that ends a name, as in `t_ms` or `angle_deg`; otherwise empty.
std::string unit_word(std::string_view quantity, const std::vector<std::string>& words) {
  if (words.size() < 2) return "";
  const std::string& last = words.back();
  return factor_of_unit(quantity, last) || is_counts(last) ? last : "";
}

/// How sure a name is for a quantity; 0: it is not. A derivative or a set-point is another quantity.
int match_score(std::string_view name, const NamesOfQuantity& quantity) {
  constexpr std::array<std::string_view, 9> others = {"dot",   "vel", "velocity", "speed",  "rate",
                                                      "accel", "ref", "setpoint", "desired"};
  const std::vector<std::string> words = words_of(name);
  int best = 0;
  for (std::size_t w = 0; w < words.size(); ++w) {
    if (std::find(others.begin(), others.end(), words[w]) != others.end()) return 0;
    // The unit at the end names no quantity.
    if (w > 0 && w + 1 == words.size() && !unit_word(quantity.quantity, words).empty()) continue;
    for (std::size_t i = 0; i < quantity.words.size(); ++i)
      if (!quantity.words[i].empty() && words[w] == quantity.words[i])
        best = std::max(best, static_cast<int>(2 * (quantity.words.size() - i)) + (w == 0 ? 1 : 0));
  }
  return best;
}

std::vector<std::string> column_names(const fs::path& file) {
  if (!is_mat_file(file))
    return read_csv(
               file, {}, {}, [](const CsvTable&) {}, [](const CsvRow&) {})
        .names;
  std::vector<std::string> names;
  for (const MatVector& vector : MatFile(file).vectors()) names.push_back(vector.path);
  return names;
}

/// Each quantity gets the surest column that no surer quantity has.
void choose_columns(const std::vector<std::string>& names, ImportProposal& proposal) {
  struct Match {
    int match_score;
    std::size_t quantity, column;
  };
  std::vector<Match> matches;
  for (std::size_t q = 0; q < names_of_quantities.size(); ++q)
    for (std::size_t c = 0; c < names.size(); ++c)
      if (const int sure = match_score(names[c], names_of_quantities[q]); sure > 0)
        matches.push_back({sure, q, c});
  std::stable_sort(matches.begin(), matches.end(),
                   [](const Match& a, const Match& b) { return a.match_score > b.match_score; });
  std::vector<bool> used(names.size(), false);
  for (const Match& match : matches) {
    ProposedColumn& column = proposal.columns[match.quantity];
    if (used[match.column] || !column.column.empty()) continue;
    used[match.column] = true;
    column.column = names[match.column];
    if (unit_in_name(column.column).empty())
      column.unit = unit_word(column.quantity, words_of(column.column));
  }
  for (std::size_t c = 0; c < names.size(); ++c)
    if (!used[c]) proposal.others.push_back(names[c]);
}

/// The units of a row under the header, for the columns that were chosen.
void read_unit_row(const fs::path& file, ImportProposal& proposal) {
  std::vector<std::string> wanted;
  for (const ProposedColumn& column : proposal.columns) wanted.push_back(column.column);
  const CsvTable table = read_csv(
      file, wanted, {}, [](const CsvTable&) {}, [](const CsvRow&) {});
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (!table.units[i].empty()) proposal.columns[i].unit.clear();  // read by the reader itself
}

std::string column_text(const ProposedColumn& column) {
  DatasetColumn source;
  source.column = column.column;
  std::string line = column_line(column.quantity, source);
  const bool known = factor_of_unit(column.quantity, column.unit).has_value();
  std::string comment;
  if (known) line.insert(line.size() - 1, ", unit: " + column.unit);
  if (is_counts(column.unit)) {
    line.insert(line.size() - 1, ", unit: counts");
    comment = std::string("   # add the size of a count: ") +
              (column.quantity == "theta_rad" ? "counts_per_revolution: N" : "m_per_count: SIZE");
  } else if (column.quantity == "theta_rad") {
    comment = "   # 0 upright; if yours is 0 hanging, add offset: 3.141592653589793";
  }
  return "    " + line + comment + "\n";
}

std::string missing_text(const ProposedColumn& column) {
  return "    # " + column.quantity + ": no column was recognised" +
         (column.quantity == "voltage_v" ? "; put its name here, or cart_locked: true below columns" : "") +
         "\n";
}

}  // namespace

bool ImportProposal::is_complete() const {
  const auto has = [&](std::string_view quantity) {
    return std::any_of(columns.begin(), columns.end(),
                       [&](const ProposedColumn& c) { return c.quantity == quantity && !c.column.empty(); });
  };
  return has("time_s") && has("voltage_v") && (has("cart_m") || has("theta_rad"));
}

ImportProposal propose_mapping(const fs::path& file) {
  ImportProposal proposal;
  proposal.file = file;
  for (const NamesOfQuantity& names : names_of_quantities)
    proposal.columns.push_back({std::string(names.quantity), "", ""});
  choose_columns(column_names(file), proposal);
  if (!is_mat_file(file)) read_unit_row(file, proposal);
  return proposal;
}

std::string dataset_text(const ImportProposal& proposal, const fs::path& folder) {
  const fs::path file = fs::absolute(proposal.file).lexically_normal();
  const fs::path relative =
      file.lexically_relative(fs::absolute(folder.empty() ? "." : folder).lexically_normal());
  std::string text =
      "# Proposed by upright import from the names of the columns: check each line "
      "(docs/reference/dataset-files.md).\n"
      "dataset:\n  file: " +
      yaml_quoted((relative.empty() ? file : relative).string()) + "\n  columns:\n";
  for (const ProposedColumn& column : proposal.columns)
    text += column.column.empty() ? missing_text(column) : column_text(column);
  if (!proposal.others.empty()) {
    text += "  # not used:";
    constexpr std::size_t max_named = 40;
    for (std::size_t i = 0; i < std::min(max_named, proposal.others.size()); ++i)
      text += (i > 0 ? ", " : " ") + proposal.others[i];
    text += proposal.others.size() > max_named ? ", ...\n" : "\n";
  }
  return text;
}

}  // namespace upright
