#include "periodic_starts.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include "base/median.hpp"
#include "candidates.hpp"

namespace upright {

namespace {

/// Sine and cosine of 2 pi f x for a rising frequency: turned by the same angle each time, since the
/// functions themselves took longer than all else.
struct Wave {
  Wave(double x, double frequency, double spacing)
      : sine(std::sin(2.0 * std::numbers::pi * frequency * x)),
        cosine(std::cos(2.0 * std::numbers::pi * frequency * x)),
        turn_sine(std::sin(2.0 * std::numbers::pi * spacing * x)),
        turn_cosine(std::cos(2.0 * std::numbers::pi * spacing * x)) {}

  void advance() {
    const double former = sine;
    sine = sine * turn_cosine + cosine * turn_sine;
    cosine = cosine * turn_cosine - former * turn_sine;
  }

  double sine, cosine, turn_sine, turn_cosine;
};

bool is_of_encoder(std::size_t effect) {
  return effect == effect_index<effects::EncoderEccentricity>();
}

/// The force of an effect of size one at its crest, to first order; of an encoder at a pitch of 2 pi.
double force_of_unit_size(std::size_t effect, const PlaceForce& at) {
  if (is_of_encoder(effect)) return -at.speed_squared_nm;
  return effect == effect_index<effects::TorqueRipple>() ? at.ripple_n : 1.0;
}

/// A sine over the track, fitted to the residual force.
struct FittedSine {
  double explained;  ///< of the sum of squares of the residual force [N^2]; when ranked, of the usual [1]
  double size, frequency_per_m, phase_rad;
};

/// Parameters of an effect whose force is this sine.
std::vector<double> start_at(const FittedSine& sine, std::size_t effect) {
  const double waves_per_m = is_of_encoder(effect) ? 2.0 * std::numbers::pi * sine.frequency_per_m : 1.0;
  const double largest = effect_registry()[effect].parameters[0].range.high;
  return {std::min(sine.size / waves_per_m, largest), 1.0 / sine.frequency_per_m, sine.phase_rad};
}

/// Sines of all frequencies beside a force that has no period: a periodogram over x.
std::vector<FittedSine> periodogram(const std::vector<PlaceForce>& residual,
                                    const std::vector<double>& unit_n, double lowest_per_m,
                                    double highest_per_m, double spacing_per_m) {
  std::vector<FittedSine> found;
  std::vector<Wave> waves;
  waves.reserve(residual.size());
  for (const PlaceForce& at : residual) waves.emplace_back(at.cart_m, lowest_per_m, spacing_per_m);
  for (double f = lowest_per_m; f <= highest_per_m; f += spacing_per_m) {
    double ss = 0.0, sc = 0.0, cc = 0.0, sy = 0.0, cy = 0.0, s1 = 0.0, c1 = 0.0, y1 = 0.0, power = 0.0;
    for (std::size_t i = 0; i < waves.size(); ++i) {
      const double unit = unit_n[i], y = residual[i].force_n;
      const double s = unit * waves[i].sine, c = unit * waves[i].cosine;
      waves[i].advance();
      ss += s * s;
      sc += s * c;
      cc += c * c;
      sy += s * y;
      cy += c * y;
      s1 += unit * s;
      c1 += unit * c;
      y1 += unit * y;
      power += unit * unit;
    }
    ss -= s1 * s1 / power;
    sc -= s1 * c1 / power;
    cc -= c1 * c1 / power;
    sy -= s1 * y1 / power;
    cy -= c1 * y1 / power;
    const double determinant = ss * cc - sc * sc;
    if (!(determinant > 1e-8 * power * power)) continue;
    const double a = (cc * sy - sc * cy) / determinant, b = (ss * cy - sc * sy) / determinant;
    found.push_back({a * sy + b * cy, std::hypot(a, b), f, std::atan2(b, a)});
  }
  return found;
}

/// What sines explain by chance about a frequency: a median, over a range of which a peak is a small part.
/// `sines`: of rising frequency, `place`: of one of them.
double usually_explained(const std::vector<FittedSine>& sines, std::size_t place) {
  constexpr double reach = 3.0;             // of the range, times the frequency
  constexpr std::size_t on_each_side = 16;  // at least, for a median
  const auto place_of = [&](double frequency_per_m) {
    return static_cast<std::size_t>(
        std::ranges::lower_bound(sines, frequency_per_m, {}, &FittedSine::frequency_per_m) - sines.begin());
  };
  const double middle_per_m = sines[place].frequency_per_m;
  const std::size_t first = std::min(place_of(middle_per_m / reach), place - std::min(place, on_each_side));
  const std::size_t end =
      std::max(place_of(middle_per_m * reach), std::min(place + on_each_side, sines.size()));
  std::vector<double> explained;
  for (std::size_t i = first; i < end; ++i) explained.push_back(sines[i].explained);
  return std::max(median_of(std::move(explained)), std::numeric_limits<double>::min());
}

/// First what explains most, compared with others of about its frequency: the residual force is not white,
/// for the noise of a position grows as a force with the square of its frequency.
std::vector<FittedSine> ranked(const std::vector<FittedSine>& sines) {
  constexpr double band = 1.2;  // of frequencies with the same comparison, which takes time
  std::vector<FittedSine> compared = sines;
  double usual_n2 = 1.0, to_per_m = 0.0;
  for (std::size_t i = 0; i < sines.size(); ++i) {
    if (sines[i].frequency_per_m >= to_per_m) {
      usual_n2 = usually_explained(sines, i);
      to_per_m = band * sines[i].frequency_per_m;
    }
    compared[i].explained /= usual_n2;
  }
  std::ranges::sort(compared, std::greater{}, &FittedSine::explained);
  return compared;
}

/// Whether none of these starts has the pitch of a sine, and few enough are within a factor of two of it.
bool differs_enough(const FittedSine& sine, const std::vector<std::vector<double>>& starts,
                    double spacing_per_m, const SearchBudget& budget) {
  std::size_t alike = 0;
  for (const std::vector<double>& start : starts) {
    const double frequency_per_m = 1.0 / start[1], ratio = sine.frequency_per_m / frequency_per_m;
    if (std::abs(frequency_per_m - sine.frequency_per_m) < 4.0 * spacing_per_m) return false;
    if (ratio < 2.0 && ratio > 0.5) ++alike;
  }
  return alike < budget.max_alike_pitches;
}

}  // namespace

/// An effect counts as one that repeats when a run passes some of its crests. Several runs at different
/// places pass the same crests together, but each could as well have a force of its own.
double longest_pitch_m(const DataRange& range, const PriorPolicy& prior) {
  return std::max(prior.min_longest_pitch_m, range.longest_travel_m / prior.crests_of_pitch);
}

std::vector<std::vector<double>> periodic_starts(std::size_t effect, const std::vector<PlaceForce>& residual,
                                                 const DataRange& range, const PriorPolicy& prior,
                                                 const SearchBudget& budget) {
  const std::vector<std::vector<double>> any = {{effect_registry()[effect].parameters[0].typical, 0.02, 0.0}};
  const double travel = range.cart_high_m - range.cart_low_m;
  if (residual.size() < budget.min_residual_samples || travel <= 0.0) return any;
  std::vector<double> unit_n;
  unit_n.reserve(residual.size());
  for (const PlaceForce& at : residual) unit_n.push_back(force_of_unit_size(effect, at));
  const double longest = longest_pitch_m(range, prior);
  // Frequencies over the track one half-cycle apart, so that no crest is missed.
  const double spacing = 0.25 / travel;
  const double shortest = std::max(0.001, 1.0 / (1.0 / longest + budget.max_frequencies * spacing));
  const std::vector<FittedSine> found = periodogram(residual, unit_n, 1.0 / longest, 1.0 / shortest, spacing);
  std::vector<std::vector<double>> starts;
  for (const FittedSine& sine : ranked(found)) {
    if (differs_enough(sine, starts, spacing, budget)) starts.push_back(start_at(sine, effect));
    if (starts.size() == budget.max_pitches) break;
  }
  return starts.empty() ? any : starts;
}

}  // namespace upright
