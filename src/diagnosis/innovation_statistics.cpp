#include "innovation_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <string_view>
#include <utility>

#include "base/median.hpp"
#include "reversal.hpp"
#include "tails.hpp"

namespace upright {

namespace {

/// Each of unit size: a force or torque, or a shift of what a sensor shows.
enum class ActsOn { cart, pendulum, position, angle };
struct Probe {
  const char* name;
  ActsOn on;
  const char* looks_like = "";
  const char* turned_round = looks_like;  ///< what it looks like with the other sign
};
constexpr std::array<Probe, residual_probe_count> probes = {
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
  ProbeState(double middle_s, const MotionPolicy& policy) : policy_(policy), middle_s_(middle_s) {}

  ProbeValues at(double time_s, double dt, double cart_mps, double theta_radps, double voltage_v) {
    const double direction = direction_of(cart_mps, policy_.still_cart_mps),
                 turn = direction_of(theta_radps, policy_.still_pendulum_radps);
    motion_.pass(direction, dt);
    voltage_.pass(direction_of(voltage_v, policy_.no_voltage_v), dt);
    pendulum_.pass(turn, dt);
    const double t = time_s - middle_s_;
    return {t,
            t * direction,
            t * cart_mps,
            t * voltage_v,
            motion_.fading(policy_.fading_after_motion_s),
            motion_.fading(policy_.slow_fading_after_motion_s),
            voltage_.fading(policy_.fading_after_voltage_s),
            t,
            t * turn,
            t * theta_radps,
            pendulum_.fading(policy_.fading_after_pendulum_s),
            voltage_v,
            direction,
            turn};
  }

 private:
  const MotionPolicy& policy_;
  double middle_s_;
  Reversal motion_, voltage_, pendulum_;
};

constexpr int states = LinearStep::states, disturbances = LinearStep::disturbances;

/// How an unmodelled force of unit size would show in the innovations: the error it makes, less what the
/// filter corrects of it.
struct Response {
  std::array<double, states + disturbances> error{};

  /// Carries the error over a sample period in which the force or torque was `size`.
  void advance(const LinearStep& step, ActsOn on, double size) {
    const double* by = on == ActsOn::pendulum ? step.by_torque : step.by_force;
    const double impulse = is_sensor(on) ? 0.0 : step.period_s * size;
    for (int i = 0; i < 2; ++i) {
      error[2 + i] += by[i] * impulse;
      for (int d = 0; d < disturbances; ++d) error[2 + i] += step.impulse[d][i] * error[states + d];
    }
    std::array<double, states + disturbances> next{};
    for (int i = 0; i < states; ++i)
      for (int j = 0; j < states; ++j) next[i] += step.transition[i][j] * error[j];
    for (int d = states; d < states + disturbances; ++d) next[d] = step.keeps * error[d];
    error = next;
  }
  /// What it shows in one channel, which the filter then corrects; the sensor itself may be off by `shift`.
  double show(const LinearStep& step, std::size_t channel, double shift = 0.0) {
    const double shown = step.gain[channel] * error[channel] + shift;
    for (int i = 0; i < states + disturbances; ++i) error[i] -= step.update[channel][i] * shown;
    return shown;
  }
};

/// Score and information of a force in the innovations.
struct Score {
  double score = 0.0, information = 0.0;
};

/// Whether a white force or torque moves its sensor within a block.
bool is_visible(const Measurement& run, const LinearStep& step, const Noise& noise, int channel,
                const ResidualPolicy& policy) {
  const double block_s = policy.block_s;
  const double white = channel == 0 ? noise.force : noise.torque;
  const double coloured = channel == 0 ? noise.coloured_force_n : noise.coloured_torque_nm;
  // Both parts, as the white noise that is as strong over a block.
  const double intensity =
      std::sqrt(white * white + 2.0 * coloured * coloured * std::min(noise.correlation_s, block_s));
  const double push = intensity * (channel == 0 ? step.by_force[0] : step.by_torque[1]);
  const double sensor = channel == 0 ? run.cart_noise_m() : run.theta_noise_rad();
  return push * std::sqrt(block_s * block_s * block_s / 3.0) > policy.visible_push * sensor;
}

/// Standard deviation of at least one number, all of which are Gaussian but for a few.
double robust_deviation(std::vector<double> values) {
  for (double& v : values) v = std::abs(v);
  return median_of(std::move(values)) / median_of_gaussian_magnitudes;
}

/// A percentile of at least one number over their median.
double dispersion_of(std::vector<double> values, std::size_t percentile) {
  std::sort(values.begin(), values.end());
  return values[values.size() * percentile / 100] / std::max(values[values.size() / 2], 1e-12);
}

Score sum_of(const std::vector<Score>& scores) {
  Score sum;
  for (const Score& s : scores) {
    sum.score += s.score;
    sum.information += s.information;
  }
  return sum;
}

/// How certainly the innovations go with a probe, by the scatter of its scores over blocks about what it
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
  return normal_deviate(t, freedom);
}

std::size_t named_probe(const InnovationStatistics& s, double min_dependence) {
  std::size_t named = 0;
  double largest_share = 0.0;
  for (std::size_t i = 0; i < probes.size(); ++i) {
    const bool certain = s.dependence[i] > min_dependence;
    if (certain ? s.share[i] <= largest_share : largest_share > 0.0 || s.dependence[i] <= s.dependence[named])
      continue;
    if (certain) largest_share = s.share[i];
    named = i;
  }
  return named;
}

}  // namespace

double InnovationStatistics::largest_dependence() const {
  return *std::max_element(dependence.begin(), dependence.end());
}

std::string name_of_residual_probe(std::size_t probe, bool is_positive) {
  const Probe& p = probes[probe];
  return std::string(p.name) + " " + std::string(place_of(p.on)) +
         (is_positive ? p.looks_like : p.turned_round);
}

/// What is collected along the samples of a segment.
class Innovations::Collector {
 public:
  explicit Collector(Innovations& into) : into_(into) {}

  void begin_step(const LinearStep& step) {
    new_step_ = true;
    for (std::size_t i = 0; i < square_speed_.size(); ++i) {
      square_speed_[i] += step.rate[i] * step.rate[i];
      held_[i] = held_[i] || step.holds[i] > 0.0;
    }
    samples_ += 1.0;
  }

  void advance(const LinearStep& step, const ProbeValues& acting) {
    for (std::size_t i = 0; i < probes.size(); ++i) responses_[i].advance(step, probes[i].on, acting[i]);
    for (std::size_t i = 0; i < 2; ++i)
      responses_[probes.size() + i].advance(step, i == 1 ? ActsOn::pendulum : ActsOn::cart, 1.0);
  }

  void add(const LinearStep& step, std::size_t channel, const ProbeValues& acting) {
    const double deviation = std::sqrt(step.variance[channel]), weight = step.weight[channel];
    Row row{channel, step.innovation[channel] / deviation, weight, {}};
    row.keeps = new_step_ ? step.keeps : 1.0;
    new_step_ = false;
    for (std::size_t d = 0; d < row.adds.size(); ++d)
      row.adds[d] = step.update[channel][states + d] * deviation;
    const ActsOn sensor = channel == 0 ? ActsOn::position : ActsOn::angle;
    for (std::size_t i = 0; i < response_count; ++i) {
      const double shift = i < probes.size() && probes[i].on == sensor ? acting[i] : 0.0;
      const double shown = responses_[i].show(step, channel, shift) / deviation;
      row.responses[i] = weight * shown;
      information_[i] += weight * shown * shown;
    }
    power_ += weight * row.normalised * row.normalised;
    weight_ += weight;
    into_.rows_.push_back(row);
  }

  /// Ends a block. Pulses count where they are `visible`. A block counts where dry friction holds nothing:
  /// where it holds and lets go, the innovations are not Gaussian under the right model.
  void close(std::array<bool, 2> visible, const ResidualPolicy& policy) {
    const bool shows_noise =
        weight_ > policy.min_block_weight && power_ > policy.at_rest * policy.at_rest * weight_;
    for (std::size_t i = 0; i < held_.size(); ++i) visible[i] = visible[i] && !held_[i];
    const bool slides = !held_[0] && !held_[1];
    const auto rms = [&](double square) { return std::sqrt(square / std::max(samples_, 1.0)); };
    into_.blocks_.push_back({into_.rows_.size(),
                             shows_noise && slides,
                             visible,
                             {rms(square_speed_[0]), rms(square_speed_[1])},
                             information_});
    information_.fill(0.0);
    square_speed_.fill(0.0);
    held_.fill(false);
    samples_ = 0.0;
    power_ = weight_ = 0.0;
    // Each pulse acts in its block alone.
    for (std::size_t i = probes.size(); i < response_count; ++i) responses_[i] = {};
  }

 private:
  Innovations& into_;
  std::array<Response, response_count> responses_;
  Responses information_{};
  double power_ = 0.0, weight_ = 0.0;
  std::array<double, 2> square_speed_{};
  std::array<bool, 2> held_{};  ///< by dry friction, for a while
  double samples_ = 0.0;
  bool new_step_ = true;
};

/// One number of each block, and a speed in it.
struct BySpeed {
  std::vector<double> values, speeds;

  void add(double value, double speed) {
    values.push_back(value);
    speeds.push_back(speed);
  }
  std::vector<double> without_growth() const { return upright::without_growth(values, speeds); }
};

/// The disturbance that a filter estimates, in its standard deviations: innovations are white.
struct EstimatedDisturbance {
  double value = 0.0, variance = 0.0;

  void take(double keeps, double added, double normalised) {
    value = keeps * value + added * normalised;
    variance = keeps * keeps * variance + added * added;
  }
};

Innovations::Innovations(const FitData& data, const FitPoint& point, const SelectionPolicy& policy)
    : min_sensor_share_(policy.adequacy.min_sensor_share),
      min_dependence_(policy.significance.noticeable_z),
      large_block_percentile_(policy.residual.large_block_percentile) {
  const std::vector<std::vector<LinearStep>> steps = linearise(data, point);
  for (std::size_t s = 0; s < steps.size(); ++s)
    examine_segment((*data.runs)[data.segments[s].run], data.segments[s], point, steps[s], policy);
}

void Innovations::examine_segment(const Measurement& run, const Segment& segment, const FitPoint& point,
                                  const std::vector<LinearStep>& steps, const SelectionPolicy& policy) {
  const ResidualPolicy& residual = policy.residual;
  const bool present[2] = {run.has_cart(), run.has_theta() && point.plant.pendulum.has_value()};
  const auto length = static_cast<std::size_t>(
      std::max(residual.min_block_samples, residual.block_s / std::max(run.median_period_s(), 1e-9)));
  ProbeState state(0.5 * (run.time_s.front() + run.time_s.back()), policy.motion);
  ProbeValues acting{};
  Collector collector(*this);
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const LinearStep& step = steps[k];
    collector.begin_step(step);
    if (k > 0) collector.advance(step, acting);
    for (std::size_t channel = 0; channel < 2; ++channel)
      if (present[channel]) collector.add(step, channel, acting);
    acting = state.at(run.time_s[segment.first + k], step.period_s, step.rate[0], step.rate[1],
                      run.voltage_v[segment.first + k]);
    if ((k + 1) % length == 0)
      collector.close(
          {is_visible(run, step, point.noise, 0, residual), is_visible(run, step, point.noise, 1, residual)},
          residual);
  }
  // What is left at the end is less than a block.
  rows_.resize(blocks_.empty() ? 0 : blocks_.back().end);
}

/// `normalised`: of a row, each in turn.
template <class Normalised>
InnovationStatistics Innovations::statistics_of(Normalised normalised) const {
  BySpeed rms;
  std::array<std::vector<Score>, residual_probe_count> probe;
  std::array<BySpeed, 2> pulses, estimates;
  std::array<EstimatedDisturbance, 2> disturbance;
  double power = 0.0;
  std::size_t at = 0;
  for (const Block& block : blocks_) {
    Responses score{};
    double block_power = 0.0, block_weight = 0.0;
    for (; at < block.end; ++at) {
      const Row& row = rows_[at];
      const double e = normalised(row);
      for (std::size_t i = 0; i < response_count; ++i) score[i] += e * row.responses[i];
      for (std::size_t i = 0; i < 2; ++i) disturbance[i].take(row.keeps, row.adds[i], e);
      block_power += row.weight * e * e;
      block_weight += row.weight;
    }
    if (block.counts) rms.add(std::sqrt(block_power / block_weight), block.speed[0]);
    power += block_power;
    for (std::size_t i = 0; i < residual_probe_count; ++i)
      probe[i].push_back({score[i], block.information[i]});
    for (std::size_t i = 0; i < 2; ++i) {
      const double information = block.information[residual_probe_count + i];
      if (information > 0.0 && block.visible[i])
        pulses[i].add(score[residual_probe_count + i] / std::sqrt(information), block.speed[i]);
      if (disturbance[i].variance > 0.0 && block.visible[i])
        estimates[i].add(disturbance[i].value / std::sqrt(disturbance[i].variance), block.speed[i]);
    }
  }
  InnovationStatistics result;
  if (!rms.values.empty()) result.dispersion = dispersion_of(rms.without_growth(), large_block_percentile_);
  for (std::size_t i = 0; i < 2; ++i) {
    if (!estimates[i].values.empty())
      result.disturbance_kurtosis[i] = kurtosis_of(estimates[i].without_growth());
    if (pulses[i].values.empty()) continue;
    result.kurtosis[i] = kurtosis_of(pulses[i].without_growth());
    result.pulse_size[i] = robust_deviation(pulses[i].values);
  }
  for (std::size_t i = 0; i < residual_probe_count; ++i) {
    const Score sum = sum_of(probe[i]);
    result.is_positive[i] = sum.score > 0.0;
    if (sum.information > 0.0 && power > 0.0)
      result.share[i] = sum.score * sum.score / (sum.information * power);
    if (!is_sensor(probes[i].on) || result.share[i] >= min_sensor_share_)
      result.dependence[i] = certainty_of(probe[i]);
  }
  result.named_probe = named_probe(result, min_dependence_);
  return result;
}

InnovationStatistics Innovations::measured() const {
  return statistics_of([](const Row& row) { return row.normalised; });
}

InnovationStatistics Innovations::drawn(std::uint64_t seed) const {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  // A reading that is repeated weighs less than one: so many together are one draw.
  std::array<double, 2> last{}, owed{1.0, 1.0};
  return statistics_of([&](const Row& row) {
    owed[row.channel] += row.weight;
    if (owed[row.channel] >= 1.0) {
      owed[row.channel] = std::min(owed[row.channel] - 1.0, 1.0);
      last[row.channel] = normal(random);
    }
    return last[row.channel];
  });
}

}  // namespace upright
