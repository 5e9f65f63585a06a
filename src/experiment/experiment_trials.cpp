// Which run comes next, how a run went, and the record of both that survives an interruption.
#include "experiment_trials.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <span>
#include <sstream>
#include <stdexcept>

#include "base/input_file.hpp"
#include "pieces/delay_sweep.hpp"
#include "record/provenance.hpp"
#include "upright/base/error.hpp"
#include "upright/control/delay_line.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

constexpr const char* journal_name = "trials.csv";
constexpr const char* journal_columns =
    "piece,label,repeat,delay_s,run_directory,reason,outcome,theta0_rad,theta_amplitude_rad,cart_amplitude_m,"
    "fall_time_s,frequency_hz,controller,gains";
constexpr std::size_t journal_cells = 14;
constexpr std::size_t journal_cells_before = 12;  // without controller and gains
constexpr const char* nothing_there = "-";

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  return cells;
}

template <class Number>
bool parse(const std::string& text, Number& value) {
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  return result.ec == std::errc{} && result.ptr == text.data() + text.size();
}

/// A name within the folder, so that a folder from somebody else leads nowhere else.
bool is_within_folder(const std::string& run_directory) {
  return !run_directory.empty() && run_directory != "." && run_directory != ".." &&
         std::filesystem::path(run_directory).filename() == run_directory;
}

bool is_delay(double delay_s) {
  return delay_s >= 0.0 && delay_s <= DelayLine::longest_delay_s;
}

/// False: not a line of the journal.
bool read_line(const std::string& line, TrialResult& r) {
  const std::vector<std::string> cells = cells_of(line);
  if (cells.size() != journal_cells && cells.size() != journal_cells_before) return false;
  if (cells.size() == journal_cells) {
    if (cells[12] != nothing_there) r.controller = cells[12];
    if (cells[13] != nothing_there) r.gains = cells[13];
  }
  r.run_directory = cells[4];
  r.reason = cells[5];
  r.outcome = cells[6];
  return is_within_folder(r.run_directory) && parse(cells[0], r.trial.piece) &&
         parse(cells[2], r.trial.repeat) && r.trial.repeat >= 0 && parse(cells[3], r.trial.delay_s) &&
         is_delay(r.trial.delay_s) && parse(cells[7], r.theta0_rad) &&
         parse(cells[8], r.theta_amplitude_rad) && parse(cells[9], r.cart_amplitude_m) &&
         parse(cells[10], r.fall_time_s) && parse(cells[11], r.frequency_hz);
}

[[noreturn]] void refuse_line(const std::filesystem::path& file, std::size_t number) {
  throw ConfigError(
      file.string() + ":" + std::to_string(number) +
      ": this line is not a trial of this experiment: restore the file from a copy, or choose another "
      "folder with --out");
}

void write_whole(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path partial = file.string() + ".partial";
  std::ofstream out(partial, std::ios::binary);
  out << text;
  out.close();
  std::error_code problem;
  if (out) std::filesystem::rename(partial, file, problem);
  if (!out || problem)
    throw Error(ExitCode::stopped,
                "cannot write " + file.string() + ": free some space on the disk of the experiment folder");
}

/// What trials.csv lists is there: data that somebody removed are not passed over.
void refuse_lost_runs(const std::filesystem::path& folder, const std::vector<TrialResult>& results) {
  std::error_code ignored;
  const std::string remedy =
      ": restore it, or choose another folder with --out, and do not change that folder until the experiment "
      "has ended";
  if (!std::filesystem::exists(folder / "experiment.yaml", ignored))
    throw Error(ExitCode::stopped, folder.string() + " was removed or moved during the experiment" + remedy);
  for (const TrialResult& r : results)
    if (!std::filesystem::exists(folder / r.run_directory / "samples.csv", ignored))
      throw Error(ExitCode::stopped, (folder / r.run_directory).string() +
                                         " was removed or moved, so a run of this experiment is lost" +
                                         remedy);
}

using RowIterator = std::vector<LogRecord>::const_iterator;

/// Whole turns of the angle about its middle per second, from `from_ns` on. Where it crosses the middle
/// counts once it has come a quarter of the amplitude beyond, so that encoders' steps do not. Not a number:
/// less than one turn.
double frequency_of(RowIterator first, RowIterator last, std::int64_t from_ns, double middle_rad,
                    double amplitude_rad) {
  const double beyond = 0.25 * amplitude_rad;
  bool below = false;
  int turns = -1;
  std::int64_t begun_ns = 0, ended_ns = 0;
  for (RowIterator at = first; at != last; ++at) {
    if (at->time_ns < from_ns) continue;
    const double lean = at->theta_rad - middle_rad;
    if (lean < -beyond) below = true;
    if (!below || lean < beyond) continue;
    below = false;
    if (++turns == 0) begun_ns = at->time_ns;
    ended_ns = at->time_ns;
  }
  return turns > 0 ? turns / (static_cast<double>(ended_ns - begun_ns) * 1e-9) : not_a_number;
}

}  // namespace

Piece piece_of(const ExperimentTrial& trial, const Piece& piece) {
  Piece one = piece;
  one.kind->set_trial(trial);
  return one;
}

std::optional<ExperimentTrial> next_trial(const std::vector<Piece>& pieces,
                                          const std::vector<TrialResult>& done) {
  for (std::size_t i = 0; i < pieces.size(); ++i)
    if (auto trial = pieces[i].kind->next_trial(i, done)) return trial;
  return std::nullopt;
}

std::string missing_transitions(const std::vector<Piece>& pieces, const std::vector<TrialResult>& done) {
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const auto* sweep = pieces[i].as<pieces::DelaySweep>();
    if (!sweep) continue;
    for (int repeat = 0; repeat < sweep->repeats; ++repeat) {
      if (!std::isnan(pieces::falls_from_s(pieces::of_repeat(done, i, repeat)))) continue;
      return "the delay sweep " + pieces[i].label + " is not complete: in repeat " +
             std::to_string(repeat + 1) + " the pendulum did not fall up to " +
             exact_text(sweep->delays_s.back() * 1e3) +
             " ms, so the delay at which it falls is unknown: add longer delays to delay_s";
    }
  }
  return "";
}

TrialResult judge_trial(const ExperimentTrial& trial, const Piece& piece, const std::vector<LogRecord>& rows,
                        StopReason reason) {
  TrialResult result;
  result.trial = trial;
  result.reason = name_of(reason);
  result.fall_time_s = result.frequency_hz = not_a_number;
  const auto balanced = [](const LogRecord& row) { return (row.flags & row_flag::feedback) != 0; };
  const auto first = std::find_if(rows.begin(), rows.end(), balanced);
  if (!balances(piece) && reason == StopReason::duration) result.outcome = "done";
  if (!balances(piece) || first == rows.end()) return result;
  auto last = first;
  for (auto at = first; at != rows.end(); ++at)
    if (balanced(*at)) last = at;
  if (last == first) return result;
  const double turn = 2.0 * 3.14159265358979323846;
  const double upright = turn * std::round(first->theta_rad / turn);
  result.theta0_rad = first->theta_rad - upright;
  const bool fell = reason == StopReason::fell || reason == StopReason::track_limit;
  // After a fall the extremes, otherwise half the width over the last third.
  const std::int64_t from_ns = fell ? first->time_ns : last->time_ns - (last->time_ns - first->time_ns) / 3;
  double theta_low = 1e9, theta_high = -1e9, cart_low = 1e9, cart_high = -1e9;
  for (auto at = first; at <= last; ++at) {
    if (at->time_ns < from_ns) continue;
    theta_low = std::min(theta_low, at->theta_rad - upright);
    theta_high = std::max(theta_high, at->theta_rad - upright);
    cart_low = std::min(cart_low, at->cart_m);
    cart_high = std::max(cart_high, at->cart_m);
  }
  result.theta_amplitude_rad = fell ? std::max(-theta_low, theta_high) : 0.5 * (theta_high - theta_low);
  result.cart_amplitude_m = fell ? std::max(-cart_low, cart_high) : 0.5 * (cart_high - cart_low);
  if (fell) result.fall_time_s = static_cast<double>(last->time_ns - first->time_ns) / 1e9;
  result.outcome = piece.kind->outcome_of(fell, reason == StopReason::duration, result.theta_amplitude_rad);
  if (result.outcome == "oscillating")
    result.frequency_hz = frequency_of(first, last + 1, from_ns, upright + 0.5 * (theta_low + theta_high),
                                       result.theta_amplitude_rad);
  return result;
}

namespace {

/// A controller with the plants it reckons with, not where they are: one that was changed since is another.
std::string controller_text(ControlConfig control) {
  std::string text;
  if (control.has_state_estimator()) text += plant_text(read_plant_file(control.state_estimator.plant));
  if (control.compensation.kind == CompensationKind::predictor)
    text += plant_text(read_plant_file(control.compensation.plant));
  control.state_estimator.plant = control.compensation.plant = "-";
  return gain_text(control) + text;
}

}  // namespace

std::string experiment_record(const ExperimentSetup& setup, const std::vector<Piece>& pieces) {
  std::string text =
      "# The experiment as it is run; trials.csv says how far it is.\nname: " + setup.experiment.name +
      "\nrig: " + std::filesystem::absolute(setup.rig.file).string() + "\npieces:\n";
  for (const Piece& piece : pieces) text += "  - " + piece_text(piece) + "\n";
  if (!setup.controllers.empty()) text += "controllers:\n";
  for (const auto& [file, control] : setup.controllers)
    text += "  - " + yaml_quoted(controller_text(control)) + "\n";
  return text;
}

std::string csv_name(const std::filesystem::path& file) {
  std::string name = file.string();
  for (char& c : name)
    if (c == ',' || c == '"' || static_cast<unsigned char>(c) < 0x20) c = '_';
  return name;
}

std::vector<TrialResult> read_trials(const std::filesystem::path& folder, const ExperimentSetup& setup,
                                     const std::vector<Piece>& pieces) {
  const std::unique_ptr<InputFile> record = InputFile::if_there(folder / "experiment.yaml");
  if (!record) return {};
  std::stringstream text;
  text << record->rdbuf();
  if (text.str() != experiment_record(setup, pieces))
    throw ConfigError(
        folder.string() +
        " holds another experiment, or the same one on another rig: choose another folder with --out");
  return read_trials(folder, pieces);
}

std::vector<TrialResult> read_trials(const std::filesystem::path& folder, const std::vector<Piece>& pieces) {
  std::vector<TrialResult> results = read_trials(folder);
  for (std::size_t i = 0; i < results.size(); ++i) {
    TrialResult& r = results[i];
    if (r.trial.piece >= pieces.size()) refuse_line(folder / journal_name, i + 2);
    const std::span<const NamedGains> controllers = pieces[r.trial.piece].kind->controllers();
    if (controllers.empty()) continue;
    const auto at = std::find_if(controllers.begin(), controllers.end(),
                                 [&](const NamedGains& c) { return c.name == r.controller; });
    if (at == controllers.end()) refuse_line(folder / journal_name, i + 2);
    r.trial.controller = static_cast<std::size_t>(at - controllers.begin());
  }
  std::erase_if(results,
                [&](const TrialResult& r) { return !pieces[r.trial.piece].kind->is_result(r.outcome); });
  return results;
}

std::vector<TrialResult> read_trials(const std::filesystem::path& folder) {
  std::vector<TrialResult> results;
  const std::filesystem::path file = folder / journal_name;
  const std::unique_ptr<InputFile> in = InputFile::if_there(file);
  if (!in) return results;
  std::string line;
  std::getline(*in, line);
  for (std::size_t number = 2; std::getline(*in, line); ++number) {
    // A line that was being written when the power went has no end.
    if (in->eof()) break;
    TrialResult r;
    if (!read_line(line, r)) refuse_line(file, number);
    results.push_back(std::move(r));
  }
  return results;
}

void write_sweep_tables(const std::filesystem::path& folder, const std::vector<Piece>& pieces,
                        const std::vector<TrialResult>& results) {
  const auto sweeps = std::count_if(pieces.begin(), pieces.end(), [](const Piece& piece) {
    return piece.as<pieces::DelaySweep>() != nullptr;
  });
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const auto* sweep = pieces[i].as<pieces::DelaySweep>();
    if (!sweep) continue;
    std::string runs = "theta0_rad,delay_s,outcome,theta_amplitude_rad,cart_amplitude_m,fall_time_s\n";
    std::string transitions = "theta0_rad,oscillates_from_s,falls_from_s\n";
    for (int repeat = 0; repeat < sweep->repeats; ++repeat) {
      const std::vector<TrialResult> of_this = pieces::of_repeat(results, i, repeat);
      if (of_this.empty()) continue;
      double theta0 = 0.0;
      for (const TrialResult& r : of_this) {
        runs += exact_text(r.theta0_rad) + "," + exact_text(r.trial.delay_s) + "," + r.outcome + "," +
                exact_text(r.theta_amplitude_rad) + "," + exact_text(r.cart_amplitude_m) + "," +
                exact_text(r.fall_time_s) + "\n";
        theta0 += std::abs(r.theta0_rad) / static_cast<double>(of_this.size());
      }
      transitions += exact_text(theta0) + "," + exact_text(pieces::oscillates_from_s(of_this)) + "," +
                     exact_text(pieces::falls_from_s(of_this)) + "\n";
    }
    const std::string before = sweeps > 1 ? pieces[i].label + "-" : "";
    write_whole(folder / (before + "sweep.csv"), runs);
    write_whole(folder / (before + "transitions.csv"), transitions);
  }
}

void write_trials(const std::filesystem::path& folder, const std::vector<Piece>& pieces,
                  const std::vector<TrialResult>& results) {
  refuse_lost_runs(folder, results);
  std::string text = std::string(journal_columns) + "\n";
  for (const TrialResult& r : results)
    text += std::to_string(r.trial.piece) + "," + pieces[r.trial.piece].label + "," +
            std::to_string(r.trial.repeat) + "," + exact_text(r.trial.delay_s) + "," + r.run_directory + "," +
            r.reason + "," + r.outcome + "," + exact_text(r.theta0_rad) + "," +
            exact_text(r.theta_amplitude_rad) + "," + exact_text(r.cart_amplitude_m) + "," +
            exact_text(r.fall_time_s) + "," + exact_text(r.frequency_hz) + "," +
            (r.controller.empty() ? nothing_there : r.controller) + "," +
            (r.gains.empty() ? nothing_there : r.gains) + "\n";
  write_whole(folder / journal_name, text);
}

}  // namespace upright
