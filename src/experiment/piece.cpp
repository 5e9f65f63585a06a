#include "piece.hpp"

#include <algorithm>

#include "pieces/all.hpp"

namespace upright {

namespace {

constexpr std::size_t longest_label = 60;

template <class... Kinds>
std::vector<std::unique_ptr<PieceKind>> one_of_each(const std::tuple<Kinds...>*) {
  std::vector<std::unique_ptr<PieceKind>> kinds;
  (kinds.push_back(std::make_unique<Kinds>()), ...);
  return kinds;
}

/// One of each kind, with the values that a piece has before it is read.
const std::vector<std::unique_ptr<PieceKind>>& unread_kinds() {
  static const std::vector<std::unique_ptr<PieceKind>> kinds =
      one_of_each(static_cast<const AllPieces*>(nullptr));
  return kinds;
}

}  // namespace

std::optional<ExperimentTrial> PieceKind::next_trial(std::size_t index,
                                                     const std::vector<TrialResult>& done) const {
  const bool is_done =
      std::any_of(done.begin(), done.end(), [&](const TrialResult& r) { return r.trial.piece == index; });
  if (is_done) return std::nullopt;
  return ExperimentTrial{index, 0, delay_s(), 0};
}

std::vector<ExperimentTrial> PieceKind::rehearsals() const {
  return {next_trial(0, {}).value()};
}

const std::vector<std::string>& piece_kinds() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const auto& kind : unread_kinds()) list.emplace_back(kind->name());
    return list;
  }();
  return names;
}

bool balances(const Piece& piece) noexcept {
  return piece.kind->balances();
}

bool compares(const Piece& piece) noexcept {
  return !piece.kind->controllers().empty();
}

Piece read_piece(const YamlMap& map) {
  const std::string word = map.choice("kind", piece_kinds());
  const auto at = std::find_if(unread_kinds().begin(), unread_kinds().end(),
                               [&](const auto& kind) { return kind->name() == word; });
  Piece piece{**at};
  piece.label = map.text_or("label", word);
  if (!is_plain_name(piece.label, longest_label))
    map.fail("label", "is '" + piece.label.substr(0, 60) + "'",
             "the name is used for folders, so use at most 60 lower-case letters, digits, '-' and '_'");
  piece.operator_does = map.text_or("operator", "");
  read_keys(*piece.kind, map);
  if (piece.kind->may_fit()) piece.fit_to_travel = map.flag_or("fit_to_travel", false);
  piece.turned = map.flag_or("turned", false);
  const char* for_hands = piece.turned ? "turned" : piece.kind->key_for_hands();
  if (for_hands && piece.operator_does.empty())
    map.fail(for_hands, "needs an operator", "describe under 'operator' what to do");
  map.finish();
  piece.source = map;
  return piece;
}

std::string piece_text(const Piece& piece) {
  std::string text = std::string("{kind: ") + piece.kind->name() + ", label: " + piece.label;
  if (!piece.operator_does.empty()) text += ", operator: " + yaml_quoted(piece.operator_does);
  text += keys_text(*piece.kind);
  if (piece.fit_to_travel) text += ", fit_to_travel: true";
  if (piece.turned) text += ", turned: true";
  return text + "}";
}

}  // namespace upright
