#include "residual_tests.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <sstream>
#include <string_view>

#include "residual.hpp"

namespace upright {

namespace {

/// What is left goes with something when it does so by this many standard errors: of the dozen dependences
/// that are tried, chance makes one in two hundred times.
constexpr double least_dependence = 3.5;
/// Or two signs together, each of which chance makes alone: where nothing was missing in the end, of 317
/// cases of the matrix 7 were as uneven and 12 went with something as much, none did both. Backlash does.
constexpr double uneven = 1.3;
constexpr double suspected_dependence = 2.5;
/// No sensor is perfect: a shift of what it shows counts when it accounts for this share of what is left.
constexpr double least_sensor_share = 0.05;
/// Kurtosis of the pulses of a disturbance that does not come in bursts. A Gaussian's is 3.
constexpr double heaviest_tails = 5.5;
/// Or two signs together, where there is too little to be certain of one: forces that last, and come in
/// bursts. Sensors that err by much now and then have heavy tails alone, a steady disturbance lasts alone.
/// (Of 1151 right answers on the matrix one had both, of 15 that missed what no effect describes five.)
constexpr double heavy_tails = 5.0;
constexpr double rather_slow = 1.4;
/// What is left may push this many times as hard over a tenth of a second and more as white noise that
/// accounts for single samples. A disturbance of 10 Hz makes it 1.8 here at most (measured on the matrix),
/// forces that go with the motion more.
constexpr double slowest = 2.5;
/// Or less than this: then it is no force, but in what the sensors show, of which a force is the second
/// derivative. Of play 0.15 to 0.55 is left here, of right answers 1 and more.
constexpr double quickest = 0.6;
/// With a suspected dependence.
constexpr double rather_quick = 0.75;

constexpr std::array feature_names = {"its mean",
                                      "velocity",
                                      "velocity squared",
                                      "direction of motion",
                                      "position",
                                      "position and direction",
                                      "voltage",
                                      "time",
                                      "time and direction of motion",
                                      "the time after a reversal of motion",
                                      "the time after a reversal of motion",
                                      "the time after a reversal of voltage",
                                      "the angle",
                                      "the pendulum's rate",
                                      "direction of the pendulum",
                                      "time and direction of the pendulum"};
constexpr std::size_t feature_count = feature_names.size();

double sign(double v, double dead) {
  return v > dead ? 1.0 : v < -dead ? -1.0 : 0.0;
}

struct Rows {
  std::vector<std::array<double, feature_count>> features;
  std::vector<double> force, torque;
  std::vector<std::size_t> fold;
};

/// Block means of residuals and features: shorter than an effect takes, longer than the smoother's memory.
Rows collect(const FitData& data, const std::vector<ResidualTrace>& traces) {
  constexpr double block_s = 0.03;
  Rows rows;
  for (std::size_t s = 0; s < traces.size(); ++s) {
    const ResidualTrace& trace = traces[s];
    const Measurement& run = (*data.runs)[trace.run];
    const Segment& segment = data.segments[s];
    double since_motion = 1.0, since_voltage = 1.0, last_direction = 0.0, last_voltage = 0.0;
    std::array<double, feature_count> sum{};
    double force = 0.0, torque = 0.0, count = 0.0, block_start = trace.time_s.front();
    for (std::size_t k = 0; k < trace.time_s.size(); ++k) {
      const double dt = k > 0 ? trace.time_s[k] - trace.time_s[k - 1] : 0.0;
      since_motion += dt;
      since_voltage += dt;
      const double v = trace.cart_mps[k], direction = sign(v, 2e-3), volts = sign(trace.voltage_v[k], 0.02);
      if (direction != 0.0 && direction != last_direction) since_motion = 0.0;
      if (volts != 0.0 && volts != last_voltage) since_voltage = 0.0;
      if (direction != 0.0) last_direction = direction;
      if (volts != 0.0) last_voltage = volts;
      const double theta = run.has_theta() ? run.theta_rad[segment.first + k] : 0.0;
      const double omega =
          run.has_theta() && k > 0 && dt > 0.0 ? (theta - run.theta_rad[segment.first + k - 1]) / dt : 0.0;
      const double t = trace.time_s[k] - run.time_s.front();
      const double omega_sign = sign(omega, 0.02);
      const std::array<double, feature_count> now = {1.0,
                                                     v,
                                                     v * std::abs(v),
                                                     direction,
                                                     trace.cart_m[k],
                                                     trace.cart_m[k] * direction,
                                                     trace.voltage_v[k],
                                                     t,
                                                     t * direction,
                                                     std::exp(-since_motion / 0.03) * last_direction,
                                                     std::exp(-since_motion / 0.15) * last_direction,
                                                     std::exp(-since_voltage / 0.05) * last_voltage,
                                                     std::sin(theta),
                                                     omega,
                                                     omega_sign,
                                                     t * omega_sign};
      for (std::size_t i = 0; i < feature_count; ++i) sum[i] += now[i];
      force += trace.force_n[k];
      torque += trace.torque_nm[k];
      count += 1.0;
      if (trace.time_s[k] - block_start < block_s) continue;
      for (double& value : sum) value /= count;
      rows.features.push_back(sum);
      rows.force.push_back(force / count);
      rows.torque.push_back(torque / count);
      rows.fold.push_back(s);
      sum.fill(0.0);
      force = torque = count = 0.0;
      block_start = trace.time_s[k];
    }
  }
  return rows;
}

/// Cross-validated share of the variance of y that the features predict, and the feature most correlated with
/// y.
std::pair<double, std::size_t> explained_share(const Rows& rows, const std::vector<double>& y) {
  const std::size_t n = y.size();
  if (n < 4 * feature_count) return {0.0, 0};
  std::array<double, feature_count> scale{};
  for (const auto& row : rows.features)
    for (std::size_t i = 0; i < feature_count; ++i) scale[i] += row[i] * row[i] / static_cast<double>(n);
  for (double& value : scale) value = value > 1e-20 ? 1.0 / std::sqrt(value) : 0.0;
  using Matrix = Eigen::Matrix<double, feature_count, feature_count>;
  using Vector = Eigen::Matrix<double, feature_count, 1>;
  constexpr std::size_t folds = 8;
  std::array<Matrix, folds> h;
  std::array<Vector, folds> g;
  h.fill(Matrix::Zero());
  g.fill(Vector::Zero());
  const auto row_of = [&](std::size_t k) {
    Vector row;
    for (std::size_t i = 0; i < feature_count; ++i)
      row[static_cast<Eigen::Index>(i)] = rows.features[k][i] * scale[i];
    return row;
  };
  for (std::size_t k = 0; k < n; ++k) {
    const Vector row = row_of(k);
    h[rows.fold[k] % folds] += row * row.transpose();
    g[rows.fold[k] % folds] += row * y[k];
  }
  const Matrix all_h = std::accumulate(h.begin(), h.end(), Matrix(Matrix::Zero()));
  const Vector all_g = std::accumulate(g.begin(), g.end(), Vector(Vector::Zero()));
  double left = 0.0, total = 0.0;
  for (std::size_t f = 0; f < folds; ++f) {
    Matrix train = all_h - h[f];
    train.diagonal().array() += 0.01 * static_cast<double>(n);
    const Vector weights = train.ldlt().solve(all_g - g[f]);
    for (std::size_t k = 0; k < n; ++k) {
      if (rows.fold[k] % folds != f) continue;
      const double off = y[k] - row_of(k).dot(weights);
      left += off * off;
      total += y[k] * y[k];
    }
  }
  std::size_t best = 0;
  for (std::size_t i = 1; i < feature_count; ++i)
    if (std::abs(all_g[static_cast<Eigen::Index>(i)]) > std::abs(all_g[static_cast<Eigen::Index>(best)]))
      best = i;
  return {total > 0.0 ? 1.0 - left / total : 0.0, best};
}

/// What no effect of the registry has, as the residual might follow it, of unit size: a force or torque, or a
/// shift of what a sensor shows, as when its drive gives way or has play.
enum class ActsOn { cart, pendulum, position, angle };
struct Probe {
  const char* name;
  ActsOn on;
  const char* looks_like = "";
  const char* turned_round = looks_like;  ///< what it looks like with the other sign
};
constexpr std::array probes = {
    Probe{"time", ActsOn::cart},
    Probe{"time and direction of motion", ActsOn::cart},
    Probe{"time and velocity", ActsOn::cart},
    Probe{"time and voltage", ActsOn::cart},
    Probe{"the time after a reversal of motion", ActsOn::cart},
    Probe{"the time after a reversal of motion", ActsOn::cart},
    Probe{"the time after a reversal of voltage", ActsOn::cart},
    Probe{"time", ActsOn::pendulum},
    Probe{"time and direction of the pendulum", ActsOn::pendulum},
    Probe{"time and the pendulum's rate", ActsOn::pendulum},
    Probe{"the time after a reversal of the pendulum", ActsOn::pendulum},
    Probe{"voltage", ActsOn::position, ", as if the drive gave way between the encoder and the cart",
          ", as if the drive gave way between the motor and the encoder"},
    Probe{"direction of motion", ActsOn::position, ", as if the encoder had play"},
    Probe{"direction of the pendulum", ActsOn::angle, ", as if the encoder had play"}};
constexpr bool is_sensor(ActsOn on) {
  return on == ActsOn::position || on == ActsOn::angle;
}
constexpr std::string_view place_of(ActsOn on) {
  switch (on) {
    case ActsOn::cart:
      return "in the cart equation";
    case ActsOn::pendulum:
      return "in the pendulum equation";
    case ActsOn::position:
      return "in the measured position";
    default:
      return "in the measured angle";
  }
}
using ProbeValues = std::array<double, probes.size()>;

/// Follows one run of samples and says what each probe is at the last one.
class ProbeState {
 public:
  explicit ProbeState(double middle_s) : middle_s_(middle_s) {}

  ProbeValues at(double time_s, double dt, double cart_mps, double theta_radps, double voltage_v) {
    const double direction = sign(cart_mps, 2e-3), turn = sign(theta_radps, 0.02);
    motion_.pass(direction, dt);
    voltage_.pass(sign(voltage_v, 0.02), dt);
    pendulum_.pass(turn, dt);
    const double t = time_s - middle_s_;
    return {t,
            t * direction,
            t * cart_mps,
            t * voltage_v,
            motion_.fading(0.03),
            motion_.fading(0.15),
            voltage_.fading(0.05),
            t,
            t * turn,
            t * theta_radps,
            pendulum_.fading(0.1),
            voltage_v,
            direction,
            turn};
  }

 private:
  struct Reversal {
    double since_s = 10.0, last = 0.0;
    void pass(double now, double dt) {
      since_s += dt;
      if (now == 0.0) return;
      if (now != last) since_s = 0.0;
      last = now;
    }
    double fading(double over_s) const { return std::exp(-since_s / over_s) * last; }
  };
  double middle_s_;
  Reversal motion_, voltage_, pendulum_;
};

constexpr int states = LinearStep::states;

/// How an unmodelled force of unit size would show in the innovations: the error it makes, less what the
/// filter corrects of it.
struct Response {
  std::array<double, states> error{};

  /// Carries the error over a sample period in which the force or torque was `size`.
  void advance(const LinearStep& step, ActsOn on, double size) {
    const double* by = on == ActsOn::pendulum ? step.by_torque : step.by_force;
    const double impulse = is_sensor(on) ? 0.0 : step.period_s * size;
    std::array<double, states> next{};
    for (int i = 0; i < states; ++i) {
      next[i] = (step.transition[i][2] * by[0] + step.transition[i][3] * by[1]) * impulse;
      for (int j = 0; j < states; ++j) next[i] += step.transition[i][j] * error[j];
    }
    error = next;
  }
  /// What it shows in one channel, which the filter then corrects; the sensor itself may be off by `shift`.
  double show(const LinearStep& step, int channel, double shift = 0.0) {
    const double shown = step.gain[channel] * error[channel] + shift;
    for (int i = 0; i < states; ++i) error[i] -= step.update[channel][i] * shown;
    return shown;
  }
};

/// Score and information of a force in the innovations.
struct Score {
  double score = 0.0, information = 0.0;
  void add(double shown, double innovation, double variance) {
    score += shown * innovation / variance;
    information += shown * shown / variance;
  }
};

/// What whitened innovations say, a block at a time.
struct Blocks {
  double power = 0.0;                                   ///< sum of their squares
  std::vector<double> rms;                              ///< of whitened innovations
  std::array<std::vector<Score>, probes.size()> probe;  ///< each probe in each block
  std::array<std::vector<double>, 2> pulses;            ///< a short force and torque, in standard errors
};

constexpr double block_s = 0.15;

/// Whether a white force or torque moves its sensor within a block. Where it does not, pulses of it are the
/// sensor's steps by another name.
bool shows(const Measurement& run, const LinearStep& step, const Noise& noise, int channel) {
  constexpr double share = 0.1;
  const double push = channel == 0 ? noise.force * step.by_force[0] : noise.torque * step.by_torque[1];
  const double sensor = channel == 0 ? run.cart_noise_m() : run.theta_noise_rad();
  return push * std::sqrt(block_s * block_s * block_s / 3.0) > share * sensor;
}

void examine_segment(const Measurement& run, const Segment& segment, const Plant& plant, const Noise& noise,
                     const std::vector<LinearStep>& steps, Blocks& blocks) {
  const bool present[2] = {run.has_cart(), run.has_theta() && plant.pendulum.has_value()};
  const auto length =
      static_cast<std::size_t>(std::max(20.0, block_s / std::max(run.median_period_s(), 1e-9)));
  ProbeState state(0.5 * (run.time_s.front() + run.time_s.back()));
  std::array<Response, probes.size()> responses;
  std::array<Response, 2> pulses;
  ProbeValues acting{};
  std::array<Score, probes.size()> scores;
  std::array<Score, 2> pulse_scores;
  double sum = 0.0, count = 0.0;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const LinearStep& step = steps[k];
    if (k > 0) {
      for (std::size_t i = 0; i < probes.size(); ++i) responses[i].advance(step, probes[i].on, acting[i]);
      for (int i = 0; i < 2; ++i) pulses[i].advance(step, i == 1 ? ActsOn::pendulum : ActsOn::cart, 1.0);
    }
    double update[states] = {};
    for (int channel = 0; channel < 2; ++channel) {
      if (!present[channel]) continue;
      const double e = step.residual[channel] - step.gain[channel] * update[channel];
      for (int i = 0; i < states; ++i) update[i] += step.update[channel][i] * e;
      sum += step.weight[channel] * e * e / step.variance[channel];
      count += step.weight[channel];
      const ActsOn sensor = channel == 0 ? ActsOn::position : ActsOn::angle;
      for (std::size_t i = 0; i < probes.size(); ++i)
        scores[i].add(responses[i].show(step, channel, probes[i].on == sensor ? acting[i] : 0.0), e,
                      step.variance[channel] / step.weight[channel]);
      for (int i = 0; i < 2; ++i)
        pulse_scores[i].add(pulses[i].show(step, channel), e, step.variance[channel] / step.weight[channel]);
    }
    acting = state.at(run.time_s[segment.first + k], step.period_s, step.rate[0], step.rate[1],
                      run.voltage_v[segment.first + k]);
    if ((k + 1) % length != 0) continue;
    constexpr double enough = 10.0;
    constexpr double at_rest = 0.1;  // within a step of its encoder a cart shows no noise
    if (count > enough && sum > at_rest * at_rest * count) blocks.rms.push_back(std::sqrt(sum / count));
    blocks.power += sum;
    for (std::size_t i = 0; i < probes.size(); ++i) blocks.probe[i].push_back(scores[i]);
    for (int i = 0; i < 2; ++i)
      if (pulse_scores[i].information > 0.0 && shows(run, step, noise, i))
        blocks.pulses[i].push_back(pulse_scores[i].score / std::sqrt(pulse_scores[i].information));
    sum = count = 0.0;
    scores.fill({});
    pulse_scores.fill({});
    pulses.fill({});
  }
}

/// Standard deviation of numbers that are Gaussian but for a few.
double robust_deviation(std::vector<double> values) {
  if (values.empty()) return 0.0;
  for (double& v : values) v = std::abs(v);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  constexpr double median_of_gaussian = 0.6745;
  return *middle / median_of_gaussian;
}

Score sum_of(const std::vector<Score>& scores) {
  Score sum;
  for (const Score& s : scores) {
    sum.score += s.score;
    sum.information += s.information;
  }
  return sum;
}

/// How certainly the residual goes with a probe, by the scatter of its scores over blocks about what it
/// accounts for: honest where the innovations are not white. (A block that holds much of what there is to see
/// scatters less about what it says itself: MacKinnon and White's HC3. And where few blocks hold most of what
/// there is to see, the scatter is not well known: Wallace's normal deviate of Student's t.)
double certainty_of(const std::vector<Score>& scores) {
  const Score sum = sum_of(scores);
  if (!(sum.information > 0.0)) return 0.0;
  double spread = 0.0, concentration = 0.0;
  for (const Score& s : scores) {
    const double share = s.information / sum.information;
    const double off = (s.score - sum.score * share) / std::max(1.0 - share, 1e-6);
    spread += off * off;
    concentration += share * share;
  }
  const double t = std::abs(sum.score) / std::sqrt(std::max(spread, sum.information));
  const double freedom = std::max(1.0 / concentration - 1.0, 1.0);
  return std::sqrt(freedom * std::log1p(t * t / freedom)) * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0);
}

/// Share of the innovations' power that a probe accounts for.
double share_of(const std::vector<Score>& scores, double power) {
  const Score sum = sum_of(scores);
  return sum.information > 0.0 && power > 0.0 ? sum.score * sum.score / (sum.information * power) : 0.0;
}

/// How large pulses are at most, in standard errors: their root mean square, or what most of them are with
/// half as much again for what chance makes of so few. 1 of too few to say.
double largest_size(const std::vector<double>& pulses) {
  constexpr std::size_t least_count = 30;
  if (pulses.size() < least_count) return 1.0;
  double sum = 0.0;
  for (const double p : pulses) sum += p * p;
  constexpr double by_chance = 1.5;
  return std::min(std::sqrt(sum / static_cast<double>(pulses.size())), by_chance * robust_deviation(pulses));
}

std::string slow_push_of(const ResidualTests& s) {
  const bool torque = s.slow_torque > s.slow_force;
  std::ostringstream text;
  text.precision(3);
  text << "over a tenth of a second the " << (torque ? "torque on the pendulum" : "force on the cart")
       << " is " << (torque ? s.slow_torque : s.slow_force)
       << " times as large as noise that accounts for single samples makes it";
  return text.str();
}

}  // namespace

ResidualPlace locate_residual(const FitData& data, const FitPoint& point) {
  const Rows rows = collect(data, smooth_residuals(data, point));
  const auto [force_share, force_feature] = explained_share(rows, rows.force);
  const auto [torque_share, torque_feature] = explained_share(rows, rows.torque);
  if (force_share >= torque_share) return {false, std::max(force_share, 0.0), feature_names[force_feature]};
  return {true, std::max(torque_share, 0.0), feature_names[torque_feature]};
}

ResidualTests examine_residuals(const FitData& data, const FitPoint& point) {
  const std::vector<std::vector<LinearStep>> steps = linearise(data, point);
  Blocks blocks;
  for (std::size_t s = 0; s < steps.size(); ++s)
    examine_segment((*data.runs)[data.segments[s].run], data.segments[s], point.plant, point.noise, steps[s],
                    blocks);
  ResidualTests result;
  if (blocks.rms.size() >= 20) {
    std::sort(blocks.rms.begin(), blocks.rms.end());
    result.dispersion =
        blocks.rms[blocks.rms.size() * 95 / 100] / std::max(blocks.rms[blocks.rms.size() / 2], 1e-12);
  }
  const Tails force = tails_of(blocks.pulses[0]), torque = tails_of(blocks.pulses[1]);
  result.tails = torque.certainty > force.certainty || blocks.pulses[0].empty() ? torque : force;
  result.slow_force = std::max(1.0, robust_deviation(blocks.pulses[0]));
  result.slow_torque = std::max(1.0, robust_deviation(blocks.pulses[1]));
  result.quick = std::min(largest_size(blocks.pulses[0]), largest_size(blocks.pulses[1]));
  // Of all that are certain, the one that accounts for most is what it goes with; else the most certain.
  double largest_share = 0.0;
  for (std::size_t i = 0; i < probes.size(); ++i) {
    const double certainty = certainty_of(blocks.probe[i]), share = share_of(blocks.probe[i], blocks.power);
    if (is_sensor(probes[i].on) && share < least_sensor_share) continue;
    const bool certain = certainty > least_dependence;
    if (certain ? share <= largest_share : certainty <= result.certainty) continue;
    if (certain) largest_share = share;
    result.certainty = certainty;
    const bool along = sum_of(blocks.probe[i]).score > 0.0;
    result.goes_with = std::string(probes[i].name) + " " + std::string(place_of(probes[i].on)) +
                       (along ? probes[i].looks_like : probes[i].turned_round);
  }
  return result;
}

void conclude_tests(ResidualTests& s) {
  std::ostringstream text;
  text.precision(3);
  const double slow = std::max(s.slow_force, s.slow_torque);
  constexpr double as_sensors = 1.15;
  s.beyond_sensors = s.noise_ratio > as_sensors;
  if (!s.beyond_sensors) {
    text << "what is left is the sensors' own noise";
  } else if (s.certainty > least_dependence) {
    s.structured = true;
    text << "what is left goes with " << s.goes_with << " (" << s.certainty << " standard errors)";
  } else if (s.dispersion > 1.6) {
    s.structured = true;
    text << "what is left comes in bursts: some stretches are " << s.dispersion
         << " times as far off as most";
  } else if (s.tails.kurtosis > heaviest_tails && s.tails.certainty > least_dependence) {
    s.structured = true;
    text << "what is left comes in bursts: short pulses of force have a kurtosis of " << s.tails.kurtosis
         << ", chance gives 3 (largest blocks " << s.dispersion << " times the median, dependence "
         << s.certainty << " standard errors)";
  } else if (s.tails.kurtosis > heavy_tails && slow > rather_slow) {
    s.structured = true;
    text << "what is left comes in bursts that last: " << slow_push_of(s) << ", with a kurtosis of "
         << s.tails.kurtosis << ", chance gives 3";
  } else if (slow > slowest) {
    s.structured = true;
    text << "what is left is too slow for noise: " << slow_push_of(s);
  } else if (s.quick < quickest || (s.quick < rather_quick && s.certainty > suspected_dependence)) {
    s.structured = true;
    text << "what is left is too quick for a force: over a tenth of a second it is " << s.quick
         << " times as large as noise that accounts for single samples makes it, so it is in what the sensors"
            " show";
  } else if (s.excess > most_excess) {
    s.structured = true;
    text << "a plain simulation is " << s.excess
         << " times as far off as noise like what is left makes it at most"
         << " (dependence " << s.certainty << " standard errors)";
  } else if (s.dispersion > uneven && s.certainty > suspected_dependence) {
    s.structured = true;
    text << "what is left is uneven (some stretches are " << s.dispersion
         << " times as far off as most) and may go with " << s.goes_with << " (" << s.certainty
         << " standard errors)";
  } else {
    text << "what is left is a disturbance that is the same all along and goes with nothing that was "
            "measured "
            "(largest blocks "
         << s.dispersion << " times the median, kurtosis of pulses " << s.tails.kurtosis << ", dependence "
         << s.certainty << " standard errors, simulation " << s.excess
         << " times as far off as such noise makes it at most, slow pushes " << slow << " times, " << s.quick
         << " at least)";
  }
  s.sentence = text.str();
}

Noise as_slow_as_left(Noise noise, const ResidualTests& structure) {
  noise.force *= structure.slow_force;
  noise.torque *= structure.slow_torque;
  return noise;
}

}  // namespace upright
