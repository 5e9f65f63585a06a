#include "data_hypotheses.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <span>

#include "base/angle_units.hpp"
#include "bounded_fit.hpp"
#include "dataset_file.hpp"
#include "folded_angle.hpp"

namespace upright {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Window lengths, the shortest first in which accelerations stand out from the sensors' noise.
constexpr double window_lengths_s[] = {0.08, 0.12, 0.2, 0.3, 0.5};
constexpr double min_over_noise = 5.0;
/// Fewer windows say nothing with certainty.
constexpr std::size_t min_windows = 24;
/// Delays and lags of a motor that may be there, and are no mistake.
constexpr double delays_s[] = {0.0, 0.01, 0.02, 0.04, 0.07, 0.1};
/// Columns are looked for that are so much later than others.
constexpr double longest_lateness_s = 0.2;
/// In each of so many parts of a record it must show, if there are so many windows in it.
constexpr std::size_t parts = 3, min_of_part = 8;
/// By how much a rig may differ from its plant file without anything being wrong with the data: masses,
/// lengths, gravity over length and motor force; and, to choose between readings, by how much it mostly does.
constexpr double generous = 4.0, close = 1.2;
/// A pendulum's zero may be so far off, as a share of gravity: 12 degrees.
constexpr double max_tilt = 0.21;
/// A constant force may be so much of the motor's.
constexpr double max_constant = 0.5;
/// Viscous friction stops no cart faster than in 10 ms, and dry friction is no more than five times its
/// weight: where the motor drives through a gear, of the mass that it moves.
constexpr double fastest_decay_per_s = 100.0, largest_friction_of_weight = 5.0;
/// Friction under load takes at most a third of the motor's force: half of what is left of it.
constexpr double largest_friction_of_force = 0.5;
/// Slower than this share of the usual speed a cart may be held by friction, whatever the voltage.
constexpr double slow = 0.2;

double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v * v;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

/// What is smaller than a thousandth of the whole depends on more than the reading.
double log_left(double accounted) {
  return std::log(std::max(1.0 - accounted, 1e-3));
}

double sign(double v) {
  return v > 0.0 ? 1.0 : v < 0.0 ? -1.0 : 0.0;
}

/// The recorded angle in its own unit, folded as the file has it.
std::vector<double> folded(const Measurement& run) {
  std::vector<double> values = run.theta_rad;
  for (std::size_t i = 0; i < run.unfoldings.size(); ++i) {
    const std::size_t end = i + 1 < run.unfoldings.size() ? run.unfoldings[i + 1].from : values.size();
    for (std::size_t k = run.unfoldings[i].from; k < end; ++k) values[k] -= run.unfoldings[i].added_rad;
  }
  return values;
}

}  // namespace

ReadingJudge::ReadingJudge(const Measurement& run, const Plant& plant)
    : run_(run), plant_(plant), period_s_(run.median_period_s()) {
  raw_[voltage_channel] = run.voltage_v;
  raw_[cart_channel] = run.cart_m;
  if (run.has_theta() && plant.pendulum) raw_[theta_channel] = folded(run);
}

double folded_every_rad(const DataReading& reading) {
  constexpr double near = 0.05;
  const double every = reading.fold * std::abs(reading.factor[theta_channel]);
  for (const double whole : {full_turn_rad, 0.5 * full_turn_rad, 0.25 * full_turn_rad})
    if (std::abs(every - whole) < near * whole) return whole;
  return every > 0.0 ? every : full_turn_rad;
}

std::optional<double> ReadingJudge::fold() const {
  const bool has_key =
      run_.dataset && run_.dataset->columns.contains("theta_rad") &&
      run_.dataset->columns.find("theta_rad")->second.folded_every_rad != DatasetColumn{}.folded_every_rad;
  if (!has(theta_channel) || has_key) return std::nullopt;
  constexpr double longest_step = 3.0;  // periods; no motion is told from a fold over more
  const auto gap_before = [&](std::size_t row) {
    return std::binary_search(run_.breaks.begin(), run_.breaks.end(), row) ||
           run_.time_s[row] - run_.time_s[row - 1] > longest_step * period_s_;
  };
  const auto every = find_fold(raw_[theta_channel], gap_before);
  if (!every) return std::nullopt;
  for (const double whole : {0.5 * full_turn_rad, 0.25 * full_turn_rad, 180.0, 90.0})
    if (std::abs(*every - whole) < 0.05 * whole) return whole;
  return std::nullopt;
}

std::vector<double> ReadingJudge::channel_of(const DataReading& reading, std::size_t channel) const {
  std::vector<double> values = raw_[reading.column[channel]];
  if (channel != theta_channel) return values;
  const bool as_read = reading.column[channel] == theta_channel && reading.factor[channel] == 1.0 &&
                       reading.fold == 0.0 && !reading.mirrored;
  if (as_read) return run_.theta_rad;
  if (reading.mirrored) unmirror(values);
  for (double& v : values) v *= reading.factor[channel];
  unfold(values, folded_every_rad(reading));
  return values;
}

/// Equations that differ in what they need, and what each accounts for with the freedom that a rig may have,
/// and with the plant file's numbers nearly.
struct ReadingJudge::Share {
  double generously = -infinity, closely = -infinity;
  double voltage_needed = infinity;
  double squares = 0.0;
};

ReadingJudge::Motion ReadingJudge::measure(const DataReading& reading, double length_s) const {
  std::vector<double> time_s = run_.time_s;
  for (double& t : time_s) t *= reading.time_factor;
  double margin_s = 0.0;
  for (const double later_s : reading.later_s) margin_s = std::max(margin_s, std::abs(later_s));
  const MotionWindows windows(time_s, run_.breaks, length_s, margin_s);
  Motion motion;
  const auto shows = [&](const WindowedMotion& m) {
    return windows.size() >= min_windows && rms(m.acceleration) > min_over_noise * m.acceleration_noise;
  };
  if (has(reading.column[cart_channel])) {
    motion.cart = windows.motion(channel_of(reading, cart_channel), reading.later_s[cart_channel]);
    motion.cart_shows = shows(motion.cart);
  }
  if (has(reading.column[theta_channel])) {
    motion.theta = windows.motion(channel_of(reading, theta_channel), reading.later_s[theta_channel]);
    motion.theta_shows = shows(motion.theta);
  }
  for (const double delay_s : delays_s)
    motion.volts.push_back(
        windows.held(raw_[reading.column[voltage_channel]], delay_s - reading.later_s[voltage_channel]));
  return motion;
}

ReadingJudge::Motion ReadingJudge::showing(const DataReading& reading) const {
  Motion motion;
  for (const double length_s : window_lengths_s) {
    motion = measure(reading, length_s);
    motion.length_s = length_s;
    if ((motion.cart_shows || !has(reading.column[cart_channel])) &&
        (motion.theta_shows || !has(reading.column[theta_channel])))
      break;
  }
  return motion;
}

/// The factors of voltage and cart, and signs, are put in afterwards: they change no window.
const ReadingJudge::Motion& ReadingJudge::motion_of(const DataReading& reading) {
  const std::array<double, 10> key = {static_cast<double>(reading.column[0]),
                                      static_cast<double>(reading.column[1]),
                                      static_cast<double>(reading.column[2]),
                                      reading.time_factor,
                                      reading.factor[theta_channel],
                                      reading.later_s[0],
                                      reading.later_s[1],
                                      reading.later_s[2],
                                      reading.fold,
                                      reading.mirrored ? 1.0 : 0.0};
  const auto found = motions_.find(key);
  if (found != motions_.end()) return found->second;
  return motions_.emplace(key, showing(reading)).first->second;
}

std::optional<ReadingJudge::Share> ReadingJudge::cart_share(const DataReading& reading, const Motion& motion,
                                                            const std::vector<double>& volts,
                                                            WindowRange range) const {
  const double pendulum_kg = plant_.pendulum ? plant_.pendulum->mass_kg : 0.0;
  const double moment = plant_.pendulum ? pendulum_kg * plant_.pendulum->length_to_com_m : 0.0;
  const double mass = plant_.cart_mass_kg + pendulum_kg, volts_per_n = 1.0 / plant_.motor.force_per_volt_n;
  const double x = reading.factor[cart_channel];
  const double moving = slow * rms(motion.cart.rate);
  BoundedFit fit;
  std::size_t rows = 0;
  double largest = 0.0, inertia = 0.0;
  for (std::size_t j = range.first; j < range.second; ++j) {
    if (std::abs(motion.cart.rate[j]) < moving) continue;
    double force = mass * x * motion.cart.acceleration[j];
    if (motion.theta_shows) {
      const double theta = motion.theta.level[j] + reading.theta_offset_rad;
      force += moment * (std::cos(theta) * motion.theta.acceleration[j] -
                         std::sin(theta) * motion.theta.rate[j] * motion.theta.rate[j]);
    }
    const double rate = x * motion.cart.rate[j], v = reading.factor[voltage_channel] * volts[j];
    // The last is friction that grows with the force. The force of the acceleration stands for it, since the
    // motor's own would explain any voltage.
    const double force_v = volts_per_n * force;
    fit.add({force_v, volts_per_n * rate, sign(rate), 1.0, sign(rate) * std::abs(force_v)}, v);
    inertia += volts_per_n * force * volts_per_n * force;
    largest = std::max(largest, std::abs(v));
    ++rows;
  }
  const std::size_t min_rows = range.second - range.first < volts.size() ? min_of_part : min_windows;
  if (rows < min_rows || !(largest > 0.0)) return std::nullopt;
  const double constant = max_constant * largest, damping = fastest_decay_per_s * mass;
  const double dry = largest_friction_of_weight * mass * plant_.gravity_mps2 * volts_per_n;
  const auto bounded = [&](double by) {
    return fit.accounted({1.0 / by, 0.0, 0.0, -constant, 0.0},
                         {by, damping, dry, constant, largest_friction_of_force});
  };
  return Share{bounded(generous), bounded(close), std::sqrt(inertia / fit.squares()) / generous,
               fit.squares()};
}

void ReadingJudge::judge_cart(const DataReading& reading, const Motion& motion,
                              ExplainedShares& shares) const {
  if (!motion.cart_shows || plant_.motor.force_per_volt_n <= 0.0) return;
  Share best;
  for (const std::vector<double>& volts : motion.volts)
    if (const auto share = cart_share(reading, motion, volts, {0, volts.size()})) {
      best.generously = std::max(best.generously, share->generously);
      best.closely = std::max(best.closely, share->closely);
      best.voltage_needed = std::min(best.voltage_needed, share->voltage_needed);
    }
  if (!std::isfinite(best.generously)) return;
  shares.cart = best.generously;
  shares.left_over += log_left(best.closely);
  shares.voltage_needed = best.voltage_needed;
}

/// Whether the cart's place is known: from its column, or because it was held.
bool ReadingJudge::cart_known(const DataReading& reading) const {
  return has(reading.column[cart_channel]) || run_.cart_locked;
}

ReadingJudge::Share ReadingJudge::pendulum_share(const DataReading& reading, const WindowedMotion& cart,
                                                 const WindowedMotion& pendulum, WindowRange range) const {
  const double length_m = plant_.pendulum->inertia_about_pivot_kgm2() /
                          (plant_.pendulum->mass_kg * plant_.pendulum->length_to_com_m);
  const double gravity = plant_.gravity_mps2 / length_m;
  const bool held = run_.cart_locked || !has(reading.column[cart_channel]);
  BoundedFit fit;
  for (std::size_t j = range.first; j < range.second; ++j) {
    const double theta = pendulum.level[j] + reading.theta_offset_rad;
    const double push =
        held ? 0.0 : -std::cos(theta) * reading.factor[cart_channel] * cart.acceleration[j] / length_m;
    fit.add({gravity * std::sin(theta), push, -pendulum.rate[j], -sign(pendulum.rate[j]),
             gravity * std::cos(theta)},
            pendulum.acceleration[j]);
  }
  const auto bounded = [&](double by) {
    return fit.accounted({1.0 / by, 1.0 / by, 0.0, 0.0, -max_tilt},
                         {by, by, infinity, 0.5 * gravity, max_tilt});
  };
  return {bounded(generous), bounded(close), infinity, fit.squares()};
}

void ReadingJudge::judge_pendulum(const DataReading& reading, const Motion& motion,
                                  ExplainedShares& shares) const {
  if (!motion.theta_shows || !plant_.pendulum || !cart_known(reading)) return;
  const Share share = pendulum_share(reading, motion.cart, motion.theta, {0, motion.theta.level.size()});
  shares.pendulum = share.generously;
  shares.left_over += log_left(share.closely);
}

ExplainedShares ReadingJudge::judge(const DataReading& reading) {
  ExplainedShares shares;
  // The sign is in the factor: what a window shows is turned with it.
  const Motion& motion = motion_of(reading);
  judge_cart(reading, motion, shares);
  judge_pendulum(reading, motion, shares);
  return shares;
}

namespace {

/// What is left of an equation at a lateness: in the whole record, and in its thirds.
using Left = std::array<double, 1 + parts>;

/// The lateness at which least is left: on a grid, on a finer one around its best, and by a parabola. It is
/// compared with the best delay that the rig may have, in each part of the record.
Lateness best_lateness(const std::function<Left(double)>& lefts_at, std::span<const double> rig_delays_s) {
  const auto left_at = [&](double later_s) { return lefts_at(later_s)[0]; };
  Lateness best;
  Left none;
  none.fill(infinity);
  for (const double delay_s : rig_delays_s) {
    const Left left = lefts_at(-delay_s);
    if (left[0] < none[0]) best.later_s = -delay_s;
    for (std::size_t part = 0; part <= parts; ++part) none[part] = std::min(none[part], left[part]);
  }
  best.left = best.left_at_best = none[0];
  for (const double step_s : {0.02, 0.004}) {
    const double around_s = step_s == 0.02 ? 0.0 : best.later_s;
    const int steps = step_s == 0.02 ? 10 : 5;
    for (int i = -steps; i <= steps; ++i) {
      const double later_s = around_s + step_s * i;
      if (later_s == best.later_s || std::abs(later_s) > longest_lateness_s) continue;
      const double left = left_at(later_s);
      if (left < best.left_at_best) {
        best.left_at_best = left;
        best.later_s = later_s;
      }
    }
  }
  constexpr double step_s = 0.004;
  const double before = left_at(best.later_s - step_s), after = left_at(best.later_s + step_s);
  const double bend = before - 2.0 * best.left_at_best + after;
  if (bend > 0.0) best.later_s += std::clamp(0.5 * (before - after) / bend, -1.0, 1.0) * step_s;
  const Left then = lefts_at(best.later_s);
  best.min_gain = infinity;
  for (std::size_t part = 1; part <= parts; ++part)
    if (none[part] >= 0.0 && then[part] >= 0.0)
      best.min_gain = std::min(best.min_gain, none[part] / std::max(then[part], 1e-9));
  return best;
}

/// Windows of a part of a record: 0 is the whole, 1 to `parts` its parts.
std::pair<std::size_t, std::size_t> part_of(std::size_t part, std::size_t windows) {
  if (part == 0) return {0, windows};
  return {windows * (part - 1) / parts, windows * part / parts};
}

}  // namespace

std::optional<Lateness> ReadingJudge::lateness_of_angle(const DataReading& reading) const {
  if (!plant_.pendulum || !has(reading.column[cart_channel]) || !has(reading.column[theta_channel]))
    return std::nullopt;
  const Motion seen = showing(reading);
  if (!seen.cart_shows || !seen.theta_shows) return std::nullopt;
  std::vector<double> time_s = run_.time_s;
  for (double& t : time_s) t *= reading.time_factor;
  const MotionWindows windows(time_s, run_.breaks, seen.length_s, 2.0 * longest_lateness_s);
  if (windows.size() < min_windows) return std::nullopt;
  const WindowedMotion cart =
      windows.motion(channel_of(reading, cart_channel), reading.later_s[cart_channel]);
  const std::vector<double> angle = channel_of(reading, theta_channel);
  const auto lefts_at = [&](double later_s) {
    const WindowedMotion pendulum = windows.motion(angle, reading.later_s[theta_channel] + later_s);
    Left left{};
    for (std::size_t part = 0; part <= parts; ++part) {
      const Share share = pendulum_share(reading, cart, pendulum, part_of(part, windows.size()));
      left[part] = share.squares > 0.0 ? 1.0 - share.generously : part == 0 ? 1.0 : -1.0;
    }
    return left;
  };
  return best_lateness(lefts_at, std::array{0.0});
}

std::optional<Lateness> ReadingJudge::lateness_of_voltage(const DataReading& reading) const {
  if (!has(reading.column[cart_channel]) || !has(reading.column[voltage_channel]) ||
      plant_.motor.force_per_volt_n <= 0.0)
    return std::nullopt;
  Motion seen = showing(reading);
  if (!seen.cart_shows) return std::nullopt;
  std::vector<double> time_s = run_.time_s;
  for (double& t : time_s) t *= reading.time_factor;
  const MotionWindows windows(time_s, run_.breaks, seen.length_s, 2.0 * longest_lateness_s);
  if (windows.size() < min_windows) return std::nullopt;
  seen.cart = windows.motion(channel_of(reading, cart_channel), reading.later_s[cart_channel]);
  if (seen.theta_shows)
    seen.theta = windows.motion(channel_of(reading, theta_channel), reading.later_s[theta_channel]);
  const std::vector<double>& volts = raw_[reading.column[voltage_channel]];
  // The motion follows the voltage with the delay of the motor. In a closed loop the voltage follows the
  // motion as well, so a later voltage must account for more than such a delay does.
  const auto lefts_at = [&](double later_s) {
    const std::vector<double> held = windows.held(volts, -reading.later_s[voltage_channel] - later_s);
    Left left{};
    for (std::size_t part = 0; part <= parts; ++part) {
      const auto share = cart_share(reading, seen, held, part_of(part, windows.size()));
      left[part] = share ? 1.0 - share->generously : part == 0 ? 1.0 : -1.0;
    }
    return left;
  };
  return best_lateness(lefts_at, delays_s);
}

}  // namespace upright
