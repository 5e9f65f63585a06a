#include "experiment_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "base/input_file.hpp"
#include "record/provenance.hpp"
#include "upright/base/error.hpp"
#include "upright/control/delay_line.hpp"
#include "upright/control/gain_file.hpp"

namespace upright {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double radians_per_degree = pi / 180.0;
constexpr double longest_s = 3600.0;              // of a piece
constexpr double longest_experiment_s = 86400.0;  // longer ones are a slip of the pen
constexpr double shortest_period_s = 0.01, lowest_frequency_hz = 1e-3;
constexpr double finest_bisection_s = 1e-5;  // a fraction of the shortest period
constexpr double shortest_travel_m = 0.03;   // the cart comes to rest within about 1 cm of where it should
constexpr double highest_voltage_v = 100.0;
constexpr double longest_travel_m = 10.0;
constexpr std::size_t most_list = 1000;
constexpr std::size_t most_controllers = 8, longest_controller_name = 20;  // a table that can be read
constexpr std::size_t longest_label = 60;

constexpr std::array kinds = {"constant_voltage", "ramp",        "coast",      "square_wave",
                              "multisine",        "slow_sine",   "free_decay", "observe",
                              "closed_loop",      "delay_sweep", "sign_check"};

std::vector<double> list(const YamlMap& map, const std::string& key, const Range& range) {
  const std::vector<double> values = map.numbers(key, range);
  if (values.empty() || values.size() > most_list)
    map.fail(key, "has " + std::to_string(values.size()) + " numbers", "give it 1 to 1000 numbers");
  return values;
}

int small(const YamlMap& map, const std::string& key, int fallback, int low, int high) {
  return static_cast<int>(map.integer_or(key, fallback, low, high));
}

/// A list, or {from, to, count}.
std::vector<double> delays(const YamlMap& map, const std::string& key) {
  std::vector<double> values;
  const Range range = Range::within(0.0, DelayLine::longest_delay_s);
  if (map.is_map(key)) {
    const YamlMap grid = map.map(key);
    const double from = grid.number("from", range), to = grid.number("to", range);
    const auto count = grid.integer("count", 2, static_cast<std::int64_t>(most_list));
    grid.finish();
    for (std::int64_t i = 0; i < count; ++i)
      values.push_back(from + (to - from) * static_cast<double>(i) / static_cast<double>(count - 1));
  } else {
    values = list(map, key, range);
  }
  for (std::size_t i = 1; i < values.size(); ++i)
    if (!(values[i] > values[i - 1]))
      map.fail(key, "does not grow", "order the delays from short to long, each once");
  return values;
}

bool is_plain_name(const std::string& name, std::size_t longest) {
  return !name.empty() && name.size() <= longest &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-_") == std::string::npos;
}

/// Controllers that take turns, by name, and how often.
void read_controllers(const YamlMap& map, Piece& piece) {
  if (!map.has("gains")) return;
  const YamlMap files = map.map("gains");
  for (const std::string& name : files.keys()) {
    if (!is_plain_name(name, longest_controller_name))
      files.fail(name, "is no name for a controller",
                 "use at most " + std::to_string(longest_controller_name) +
                     " lower-case letters, digits, '-' and '_', it names folders");
    piece.controllers.push_back({name, files.path(name)});
  }
  files.finish();
  if (piece.controllers.size() < 2 || piece.controllers.size() > most_controllers)
    map.fail("gains", "has " + std::to_string(piece.controllers.size()) + " controllers",
             "give it 2 to " + std::to_string(most_controllers) + ", as {name: gain file, name: gain file}");
  piece.repeats = small(map, "repeats", 5, 1, 100);
}

/// Where the hand of a simulated rig lets go: one angle, or one for each round in turn.
void read_release(const YamlMap& map, Piece& piece) {
  const Range degrees = Range::within(-8.0, 8.0);
  if (!compares(piece) || !map.has("theta0_deg") || !map.is_list("theta0_deg")) {
    piece.theta0_rad = map.number_or("theta0_deg", 2.0, degrees) * radians_per_degree;
    return;
  }
  for (const double angle_deg : list(map, "theta0_deg", degrees))
    piece.starts_rad.push_back(angle_deg * radians_per_degree);
}

void read_start(const YamlMap& map, Piece& piece) {
  piece.start = map.has("start") && map.choice("start", {"hand", "swing_up"}) == "swing_up"
                    ? StartBy::swing_up
                    : StartBy::hand;
  read_release(map, piece);
  piece.patience_s = map.number_or("patience_s", 60.0, Range{0.0, longest_s, true});
}

void read_fields(const YamlMap& map, Piece& piece) {
  const Range voltage{0.0, highest_voltage_v, true};
  const Range seconds{0.0, longest_s, true};
  const Range periods = Range::within(shortest_period_s, longest_s);
  const Range hertz = Range::within(lowest_frequency_hz, 1000.0);
  switch (piece.kind) {
    case PieceKind::constant_voltage:
      piece.voltages_v = list(map, "voltages_v", voltage);
      piece.repeats = small(map, "repeats", 1, 1, 100);
      break;
    case PieceKind::ramp:
      piece.rate_v_per_s = map.number("rate_v_per_s", Range{0.0, 10.0, true});
      piece.largest_v = map.number_or("largest_v", 4.0, voltage);
      piece.repeats = small(map, "repeats", 1, 1, 100);
      break;
    case PieceKind::coast:
      piece.voltages_v = list(map, "voltages_v", voltage);
      piece.push_s = map.number("push_s", Range{0.0, 10.0, true});
      piece.repeats = small(map, "repeats", 1, 1, 100);
      break;
    case PieceKind::square_wave:
      piece.amplitude_v = map.number("amplitude_v", voltage);
      piece.period_s = map.number("period_s", periods);
      piece.duration_s = map.number("duration_s", seconds);
      break;
    case PieceKind::multisine:
      piece.amplitude_v = map.number("amplitude_v", voltage);
      piece.lowest_hz = map.number("lowest_hz", hertz);
      piece.highest_hz = map.number("highest_hz", hertz);
      if (piece.highest_hz <= piece.lowest_hz)
        map.fail("highest_hz", "is not above lowest_hz", "give it a higher frequency");
      piece.lines = small(map, "lines", 8, 2, 64);
      piece.duration_s = map.number("duration_s", seconds);
      break;
    case PieceKind::slow_sine:
      piece.amplitude_m = map.number("amplitude_m", Range{0.0, longest_travel_m, true});
      piece.period_s = map.number("period_s", periods);
      piece.duration_s = map.number("duration_s", seconds);
      break;
    case PieceKind::free_decay:
      piece.angle_rad = map.number("angle_deg", Range::within(5.0, 170.0)) * radians_per_degree;
      piece.duration_s = map.number("duration_s", seconds);
      piece.patience_s = map.number_or("patience_s", 60.0, seconds);
      break;
    case PieceKind::observe:
      piece.duration_s = map.number("duration_s", seconds);
      piece.push_mps = map.number_or("simulated_push_mps", 0.0, Range::within(-2.0, 2.0));
      break;
    case PieceKind::closed_loop:
      piece.set_points_m = list(map, "set_points_m", Range::within(-longest_travel_m, longest_travel_m));
      piece.hold_s = map.number("hold_s", seconds);
      piece.delay_s = map.number_or("delay_s", 0.0, Range::within(0.0, DelayLine::longest_delay_s));
      read_controllers(map, piece);
      read_start(map, piece);
      break;
    case PieceKind::delay_sweep:
      piece.delays_s = delays(map, "delay_s");
      piece.duration_s = map.number("duration_s", seconds);
      piece.repeats = small(map, "repeats", 1, 1, 100);
      piece.bisect_to_s = map.number_or("bisect_to_s", 0.0, Range::within(0.0, 1.0));
      if (piece.bisect_to_s > 0.0 && piece.bisect_to_s < finest_bisection_s)
        map.fail("bisect_to_s", "is " + exact_text(piece.bisect_to_s),
                 "give 0 or a number from " + exact_text(finest_bisection_s));
      piece.stable_below_rad = map.number_or("stable_below_rad", 0.0061, Range{0.0, 1.0, true});
      read_start(map, piece);
      break;
    case PieceKind::sign_check:
      piece.largest_v = map.number_or("largest_v", 4.0, voltage);
      piece.patience_s = map.number_or("patience_s", 60.0, seconds);
      break;
  }
}

/// What a piece takes at least, or where the plant decides, at most; the ways between its stretches not
/// counted.
double time_of(const Piece& piece) {
  constexpr double stretch_s = 1.0;  // of one voltage in one direction
  const double stretches = 2.0 * piece.repeats * static_cast<double>(piece.voltages_v.size());
  switch (piece.kind) {
    case PieceKind::constant_voltage:
      return stretch_s * stretches;
    case PieceKind::coast:
      return piece.push_s * stretches;
    case PieceKind::ramp:
      return 2.0 * piece.repeats * piece.largest_v / piece.rate_v_per_s;
    case PieceKind::closed_loop:
      return piece.hold_s * static_cast<double>(piece.set_points_m.size());
    default:
      return piece.duration_s;
  }
}

/// The key that makes a piece long.
const char* key_of_time(const Piece& piece) {
  switch (piece.kind) {
    case PieceKind::constant_voltage:
    case PieceKind::coast:
      return "voltages_v";
    case PieceKind::ramp:
      return "rate_v_per_s";
    case PieceKind::closed_loop:
      return "hold_s";
    default:
      return "duration_s";
  }
}

/// Refuses what nobody can have meant. `total_s`: of the pieces before; this one's time is added.
void refuse_long_times(const YamlMap& item, const Piece& piece, double& total_s) {
  const double time_s = time_of(piece);
  if (time_s > longest_s)
    item.fail(key_of_time(piece), "makes the piece last " + exact_text(std::ceil(time_s)) + " s",
              "make the piece shorter than " + exact_text(longest_s) + " s");
  double runs = 1.0;
  if (piece.kind == PieceKind::delay_sweep)
    runs = static_cast<double>(piece.repeats) * static_cast<double>(piece.delays_s.size());
  else if (compares(piece))
    runs = static_cast<double>(piece.repeats) * static_cast<double>(piece.controllers.size());
  total_s += runs * time_s;
  if (total_s > longest_experiment_s)
    item.fail(key_of_time(piece), "makes the experiment last more than a day",
              "make it shorter, or split the file");
}

bool may_fit(PieceKind kind) {
  return kind == PieceKind::constant_voltage || kind == PieceKind::coast || kind == PieceKind::square_wave ||
         kind == PieceKind::multisine;
}

Experiment read(const YamlMap& document, std::string text) {
  const YamlMap map = document.map("experiment");
  Experiment experiment;
  experiment.name = map.text("name");
  if (!is_plain_name(experiment.name, longest_label))
    map.fail("name", "is '" + experiment.name.substr(0, 60) + "'",
             "use at most 60 lower-case letters, digits, '-' and '_', it names folders");
  experiment.why = map.text("why");
  if (map.has("plant")) experiment.plant = map.path("plant");
  if (map.has("gains")) experiment.gains = map.path("gains");
  if (map.has("sample_rate_hz"))
    experiment.sample_rate_hz =
        map.number("sample_rate_hz", Range::within(lowest_sample_rate_hz, highest_sample_rate_hz));
  experiment.travel_m = map.number("travel_m", Range::within(shortest_travel_m, longest_travel_m));
  experiment.voltage_limit_v = map.number("voltage_limit_v", Range{0.0, highest_voltage_v, true});
  std::set<std::string> labels;
  double total_s = 0.0;
  for (const YamlMap& item : map.maps("pieces")) {
    Piece piece = read_piece(item);
    if (balances(piece) && !compares(piece) && experiment.gains.empty())
      item.fail("kind", "is one that balances, and the experiment names no gains",
                "add gains: a gain file to the experiment");
    const std::string label = piece.label;
    for (int i = 2; labels.contains(piece.label); ++i) piece.label = label + "-" + std::to_string(i);
    labels.insert(piece.label);
    for (const double v : piece.voltages_v)
      if (v > experiment.voltage_limit_v)
        item.fail("voltages_v", "goes to " + exact_text(v) + ", above voltage_limit_v",
                  "lower it, or raise voltage_limit_v");
    for (const double v : {piece.amplitude_v, piece.largest_v})
      if (v > experiment.voltage_limit_v)
        item.fail(piece.amplitude_v > 0.0 ? "amplitude_v" : "largest_v",
                  "is " + exact_text(v) + ", above voltage_limit_v", "lower it, or raise voltage_limit_v");
    for (const double x : piece.set_points_m)
      if (std::abs(x) >= experiment.travel_m)
        item.fail("set_points_m", "has " + exact_text(x) + ", beyond travel_m",
                  "bring the set-points nearer to the middle");
    if (piece.amplitude_m >= experiment.travel_m)
      item.fail("amplitude_m", "is not below travel_m", "lower it");
    refuse_long_times(item, piece, total_s);
    experiment.pieces.push_back(std::move(piece));
  }
  if (experiment.pieces.empty() || experiment.pieces.size() > 100)
    map.fail("pieces", "has " + std::to_string(experiment.pieces.size()) + " entries",
             "give 1 to 100 pieces");
  map.finish();
  document.finish();
  experiment.text = std::move(text);
  experiment.source = map;
  return experiment;
}

std::string numbers_text(const std::vector<double>& values) {
  std::string text = "[";
  for (const double value : values) text += (text.size() > 1 ? ", " : "") + exact_text(value);
  return text + "]";
}

/// Degrees whose reader gives the same radians, bit for bit where there are any.
std::string degrees_text(double rad) {
  double degrees = rad / radians_per_degree;
  for (int i = -2; i <= 2; ++i) {
    double near = degrees;
    for (int j = 0; j < std::abs(i); ++j) near = std::nextafter(near, i < 0 ? -1e9 : 1e9);
    if (near * radians_per_degree == rad) degrees = near;
  }
  const double rounded = std::round(degrees * 1e6) / 1e6;
  return exact_text(rounded * radians_per_degree == rad ? rounded : degrees);
}

}  // namespace

const char* name_of(PieceKind kind) noexcept {
  return kinds[static_cast<std::size_t>(kind)];
}

bool balances(const Piece& piece) noexcept {
  return piece.kind == PieceKind::closed_loop || piece.kind == PieceKind::delay_sweep;
}

bool compares(const Piece& piece) noexcept {
  return !piece.controllers.empty();
}

Piece read_piece(const YamlMap& map) {
  Piece piece;
  const std::string word = map.choice("kind", {kinds.begin(), kinds.end()});
  piece.kind = static_cast<PieceKind>(std::find(kinds.begin(), kinds.end(), word) - kinds.begin());
  piece.label = map.text_or("label", word);
  if (!is_plain_name(piece.label, longest_label))
    map.fail("label", "is '" + piece.label.substr(0, 60) + "'",
             "use at most 60 lower-case letters, digits, '-' and '_', it names folders");
  piece.operator_does = map.text_or("operator", "");
  read_fields(map, piece);
  if (may_fit(piece.kind)) piece.fit_to_travel = map.flag_or("fit_to_travel", false);
  if (piece.kind == PieceKind::observe) piece.amplifier_off = map.flag_or("amplifier_off", false);
  piece.turned = map.flag_or("turned", false);
  if ((piece.turned || piece.amplifier_off) && piece.operator_does.empty())
    map.fail(piece.turned ? "turned" : "amplifier_off", "needs somebody's hands",
             "say under operator what to do");
  map.finish();
  piece.source = map;
  return piece;
}

namespace {

std::string controllers_text(const std::vector<NamedGains>& controllers) {
  std::string text = "{";
  for (const NamedGains& c : controllers)
    text += (text.size() > 1 ? ", " : "") + c.name + ": " +
            yaml_quoted(std::filesystem::absolute(c.file).lexically_normal().string());
  return text + "}";
}

std::string release_text(const Piece& piece) {
  if (piece.starts_rad.empty()) return degrees_text(piece.theta0_rad);
  std::string text = "[";
  for (const double start_rad : piece.starts_rad)
    text += (text.size() > 1 ? ", " : "") + degrees_text(start_rad);
  return text + "]";
}

}  // namespace

std::string piece_text(const Piece& p) {
  std::string text = std::string("{kind: ") + name_of(p.kind) + ", label: " + p.label;
  const auto number = [&](const char* key, double value) {
    text += std::string(", ") + key + ": " + exact_text(value);
  };
  const auto integer = [&](const char* key, int value) {
    text += std::string(", ") + key + ": " + std::to_string(value);
  };
  const auto start = [&] {
    text += std::string(", start: ") + (p.start == StartBy::swing_up ? "swing_up" : "hand") +
            ", theta0_deg: " + release_text(p);
    number("patience_s", p.patience_s);
  };
  if (!p.operator_does.empty()) text += ", operator: " + yaml_quoted(p.operator_does);
  switch (p.kind) {
    case PieceKind::constant_voltage:
      text += ", voltages_v: " + numbers_text(p.voltages_v);
      integer("repeats", p.repeats);
      break;
    case PieceKind::ramp:
      number("rate_v_per_s", p.rate_v_per_s);
      number("largest_v", p.largest_v);
      integer("repeats", p.repeats);
      break;
    case PieceKind::coast:
      text += ", voltages_v: " + numbers_text(p.voltages_v);
      number("push_s", p.push_s);
      integer("repeats", p.repeats);
      break;
    case PieceKind::square_wave:
      number("amplitude_v", p.amplitude_v);
      number("period_s", p.period_s);
      number("duration_s", p.duration_s);
      break;
    case PieceKind::multisine:
      number("amplitude_v", p.amplitude_v);
      number("lowest_hz", p.lowest_hz);
      number("highest_hz", p.highest_hz);
      integer("lines", p.lines);
      number("duration_s", p.duration_s);
      break;
    case PieceKind::slow_sine:
      number("amplitude_m", p.amplitude_m);
      number("period_s", p.period_s);
      number("duration_s", p.duration_s);
      break;
    case PieceKind::free_decay:
      text += ", angle_deg: " + degrees_text(p.angle_rad);
      number("duration_s", p.duration_s);
      number("patience_s", p.patience_s);
      break;
    case PieceKind::observe:
      number("duration_s", p.duration_s);
      number("simulated_push_mps", p.push_mps);
      if (p.amplifier_off) text += ", amplifier_off: true";
      break;
    case PieceKind::closed_loop:
      text += ", set_points_m: " + numbers_text(p.set_points_m);
      number("hold_s", p.hold_s);
      number("delay_s", p.delay_s);
      if (compares(p)) {
        text += ", gains: " + controllers_text(p.controllers);
        integer("repeats", p.repeats);
      }
      start();
      break;
    case PieceKind::delay_sweep:
      text += ", delay_s: " + numbers_text(p.delays_s);
      number("duration_s", p.duration_s);
      integer("repeats", p.repeats);
      number("bisect_to_s", p.bisect_to_s);
      number("stable_below_rad", p.stable_below_rad);
      start();
      break;
    case PieceKind::sign_check:
      number("largest_v", p.largest_v);
      number("patience_s", p.patience_s);
      break;
  }
  if (p.fit_to_travel) text += ", fit_to_travel: true";
  if (p.turned) text += ", turned: true";
  return text + "}";
}

Experiment read_experiment_text(const std::string& text, const std::filesystem::path& file) {
  return read(YamlMap::from_text(text, file), text);
}

Experiment read_experiment_file(const std::filesystem::path& file) {
  // Read once: what was checked is what is kept.
  return read_experiment_text(whole_file(file), file);
}

}  // namespace upright
