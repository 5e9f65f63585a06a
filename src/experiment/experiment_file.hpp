// Experiment files: what is to be measured and why, as a list of pieces that are run in turn. Read strictly,
// each piece written so that it reads back exactly (run.yaml holds the one that made the run).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "upright/base/yaml_reader.hpp"

namespace upright {

enum class PieceKind : std::uint8_t {
  constant_voltage,  ///< from one side of the track to the other, both directions
  ramp,              ///< slowly up to breakaway, both directions
  coast,             ///< a push, then zero volts, both directions
  square_wave,
  multisine,
  slow_sine,    ///< the cart follows a slow sine under a velocity servo (the paper's Figure 5)
  free_decay,   ///< pendulum let go from an angle, cart held
  observe,      ///< zero volts, whatever the operator does is logged
  closed_loop,  ///< balance, with set-point steps
  delay_sweep,  ///< balance under one delay after another
  sign_check,   ///< low pulses that tell whether signs and directions agree
};

/// "constant_voltage", "ramp", ...
const char* name_of(PieceKind kind) noexcept;

/// Who brings the pendulum upright.
enum class StartBy : std::uint8_t { hand, swing_up };

/// A controller that takes turns with others: the name it is told by, and its gain file.
struct NamedGains {
  std::string name;
  std::filesystem::path file;
};

/// One piece. Which fields count depends on the kind; docs/reference/experiment-files.md has the table.
struct Piece {
  PieceKind kind = PieceKind::observe;
  std::string label;
  std::string operator_does;  ///< what somebody must do that no sensor sees; empty: nothing
  std::vector<double> voltages_v;
  double amplitude_v = 0.0;
  double period_s = 0.0;
  double duration_s = 0.0;
  double lowest_hz = 0.0, highest_hz = 0.0;
  int lines = 0;
  double rate_v_per_s = 0.0, largest_v = 0.0;
  int repeats = 1;
  double push_s = 0.0;
  double amplitude_m = 0.0;
  double angle_rad = 0.0;  ///< from hanging
  std::vector<double> set_points_m;
  double hold_s = 0.0;
  double delay_s = 0.0;
  std::vector<double> delays_s;  ///< increasing
  double bisect_to_s = 0.0;      ///< 0: transitions are not bisected
  double stable_below_rad = 0.0;
  StartBy start = StartBy::hand;
  double theta0_rad = 0.0;  ///< where the hand of a simulated rig lets go
  double push_mps = 0.0;    ///< what the hand of a simulated rig gives the cart (observe)
  /// Controllers that take turns, from the same starts (closed_loop); empty: the experiment's.
  std::vector<NamedGains> controllers;
  /// With `controllers`: the same for one round after another; empty: theta0_rad in each.
  std::vector<double> starts_rad;
  double patience_s = 0.0;     ///< longest wait for the operator
  bool fit_to_travel = false;  ///< lower the voltage until the prediction stays within the travel
  bool amplifier_off = false, turned = false;
  std::optional<YamlMap> source;  ///< where it was read: for what only the plan can refuse
};

/// True for the kinds that balance.
bool balances(const Piece& piece) noexcept;

/// True where controllers take turns.
bool compares(const Piece& piece) noexcept;

struct Experiment {
  std::string name;
  std::string why;
  std::filesystem::path plant;  ///< what the plan is made with; empty: not given
  std::filesystem::path gains;  ///< empty: not given
  double sample_rate_hz = 0.0;  ///< 0: the gain file's, or 1000
  double travel_m = 0.0;        ///< the cart stays within +- this
  double voltage_limit_v = 0.0;
  std::vector<Piece> pieces;
  std::string text;               ///< of the file, as it was read
  std::optional<YamlMap> source;  ///< where it was read: for what only the plan can refuse
};

/// Reads an experiment file. Throws ConfigError with remedy, file, line and key.
Experiment read_experiment_file(const std::filesystem::path& file);
/// The same from text; `file` is the name that errors show and that paths start from.
Experiment read_experiment_text(const std::string& text, const std::filesystem::path& file);

Piece read_piece(const YamlMap& map);
/// The piece as a YAML flow map that `read_piece` reads back exactly.
std::string piece_text(const Piece& piece);

}  // namespace upright
