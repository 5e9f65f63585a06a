#include "piece.hpp"

#include <algorithm>

#include "pieces/all.hpp"

namespace upright {

namespace {

constexpr const char* any_character = "[\\s\\S]";

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

void piece_keys(PieceKeys& keys, Piece& piece) {
  std::size_t at = 0;
  keys.one_of("kind", at, piece_kinds());
  piece = {*unread_kinds()[at]};
  piece.label = piece.kind->name();
  if (keys.given("label", true)) keys.name("label", piece.label, "");
  if (keys.decides_by_presence("operator", true)) {
    keys.text("operator", piece.operator_does, "");
    if (!keys.decides_by_pattern("operator", any_character, !piece.operator_does.empty()))
      piece.operator_does.clear();
  }
  piece.kind->keys(keys);
  if (piece.kind->may_fit()) keys.flag("fit_to_travel", piece.fit_to_travel);
  keys.flag("turned", piece.turned);
  if (const char* for_hands = piece.turned ? "turned" : piece.kind->key_for_hands())
    keys.needs(for_hands, !piece.operator_does.empty(), "needs an operator",
               "describe under 'operator' what to do");
  if (const YamlMap* map = keys.source()) {
    map->finish();
    piece.source = *map;
  }
}

Piece read_piece(const YamlMap& map) {
  Piece piece;
  read_piece_keys(map, [&piece](PieceKeys& keys) { piece_keys(keys, piece); });
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
