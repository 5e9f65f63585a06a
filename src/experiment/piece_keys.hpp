// The keys of a piece in an experiment file. Each kind lists them once, with range and default; what visits
// the list reads the piece, writes it, or looks at its voltages.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/yaml_keys.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

/// A controller that takes turns with others: the name it is told by, and its gain file.
struct NamedGains {
  std::string name;
  std::filesystem::path file;
};

// Ranges that several kinds share. The unit of a number stands in its key.
constexpr double longest_piece_s = 3600.0;
constexpr double highest_voltage_v = 100.0;
constexpr double longest_travel_m = 10.0;
constexpr Range any_voltage{0.0, highest_voltage_v, true};
constexpr Range any_duration{0.0, longest_piece_s, true};
constexpr Range any_period = Range::within(0.01, longest_piece_s);

// Sizes that can be read by people.
constexpr std::size_t longest_name = 60;
constexpr std::size_t max_list_length = 1000;
constexpr std::size_t max_controllers = 8, longest_controller_name = 20;

/// Visits the keys of a piece: besides those that any section may have, some that mean voltages, angles or
/// gain files.
class PieceKeys : public virtual YamlKeys {
 public:
  using VisitPiece = std::function<void(PieceKeys&)>;
  using VisitPieceItem = std::function<void(PieceKeys&, std::size_t)>;

  /// A map of such keys, and a list of them.
  virtual void piece_map(const char* /*key*/, const VisitPiece& /*visit*/) {}
  virtual void piece_maps(const char* /*key*/, const VisitPieceItem& /*visit*/) {}
  /// A name for folders. Without a default it is required.
  virtual void name(const char* /*key*/, std::string& /*value*/,
                    const std::optional<std::string>& /*otherwise*/) {}
  /// 1 to 1000 numbers.
  virtual void list(const char* /*key*/, std::vector<double>& /*values*/, const Range& /*range*/) {}
  /// A list that grows, or {from, to, count}.
  virtual void growing(const char* /*key*/, std::vector<double>& /*values*/, const Range& /*range*/) {}
  /// A voltage that the piece puts out: the plan may lower it.
  virtual void voltage(const char* /*key*/, double& /*value*/) {}
  virtual void voltages(const char* /*key*/, std::vector<double>& /*values*/) {}
  /// The voltage up to which a piece may go.
  virtual void largest_voltage(const char* /*key*/, double& /*value*/, double /*otherwise*/) {}
  /// An angle that stands in the file in degrees.
  virtual void angle(const char* /*key*/, double& /*value_rad*/, const Range& /*degrees*/,
                     std::optional<double> /*otherwise_deg*/) {}
  /// One angle, or a list of them: then `values_rad` is not empty.
  virtual void angle_or_list(const char* /*key*/, double& /*value_rad*/, std::vector<double>& /*values_rad*/,
                             const Range& /*degrees*/, double /*otherwise_deg*/) {}
  /// 2 to 8 gain files by name; left out: none.
  virtual void controllers(const char* /*key*/, std::vector<NamedGains>& /*controllers*/) {}
};

class PieceKind;

/// Reads the keys that `visit` visits from a map without finish(). Throws ConfigError with remedy, file, line
/// and key.
void read_piece_keys(const YamlMap& map, const PieceKeys::VisitPiece& visit);
/// ", key: value" for each key, as it is read back exactly.
std::string keys_text(const PieceKind& kind);

/// A voltage among the keys of a piece.
struct KeyedVoltage {
  const char* key = nullptr;  ///< null: it has none
  double voltage_v = 0.0;
};
/// The largest voltage that a piece asks for.
KeyedVoltage largest_voltage(const PieceKind& kind);
/// The one voltage about which a piece swings; none where it has a list of them, or only a bound.
KeyedVoltage amplitude_of(const PieceKind& kind);
/// Lowers the voltages that a piece puts out.
void scale_voltages(PieceKind& kind, double factor);
/// Throws ConfigError at the key of `map` whose voltage is above `limit_v`, of an experiment.
void refuse_voltages_above(double limit_v, const PieceKind& kind, const YamlMap& map);

/// Names folders: lower-case letters, digits, '-' and '_'.
bool is_plain_name(const std::string& name, std::size_t longest);
/// The same as a regular expression.
std::string plain_name_pattern(std::size_t longest);

}  // namespace upright
