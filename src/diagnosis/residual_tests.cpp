#include "residual_tests.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "reversal.hpp"

namespace upright {

namespace {

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
  double show(const LinearStep& step, int channel, double shift = 0.0) {
    const double shown = step.gain[channel] * error[channel] + shift;
    for (int i = 0; i < states + disturbances; ++i) error[i] -= step.update[channel][i] * shown;
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

/// What the innovations of a block say so far.
class BlockSums {
 public:
  void advance(const LinearStep& step, const ProbeValues& acting) {
    for (std::size_t i = 0; i < probes.size(); ++i) responses_[i].advance(step, probes[i].on, acting[i]);
    for (int i = 0; i < 2; ++i) pulses_[i].advance(step, i == 1 ? ActsOn::pendulum : ActsOn::cart, 1.0);
  }
  void add(const LinearStep& step, int channel, const ProbeValues& acting) {
    const double e = step.innovation[channel];
    sum_ += step.weight[channel] * e * e / step.variance[channel];
    count_ += step.weight[channel];
    const ActsOn sensor = channel == 0 ? ActsOn::position : ActsOn::angle;
    for (std::size_t i = 0; i < probes.size(); ++i)
      scores_[i].add(responses_[i].show(step, channel, probes[i].on == sensor ? acting[i] : 0.0), e,
                     step.variance[channel] / step.weight[channel]);
    for (int i = 0; i < 2; ++i)
      pulse_scores_[i].add(pulses_[i].show(step, channel), e, step.variance[channel] / step.weight[channel]);
  }
  /// Ends the block. Pulses count where they are `visible`.
  void close(const std::array<bool, 2>& visible, const ResidualPolicy& policy, Blocks& blocks) {
    if (count_ > policy.min_block_weight && sum_ > policy.at_rest * policy.at_rest * count_)
      blocks.rms.push_back(std::sqrt(sum_ / count_));
    blocks.power += sum_;
    for (std::size_t i = 0; i < probes.size(); ++i) blocks.probe[i].push_back(scores_[i]);
    for (std::size_t i = 0; i < 2; ++i)
      if (pulse_scores_[i].information > 0.0 && visible[i])
        blocks.pulses[i].push_back(pulse_scores_[i].score / std::sqrt(pulse_scores_[i].information));
    sum_ = count_ = 0.0;
    scores_.fill({});
    pulse_scores_.fill({});
    pulses_.fill({});
  }

 private:
  std::array<Response, probes.size()> responses_;
  std::array<Response, 2> pulses_;
  std::array<Score, probes.size()> scores_;
  std::array<Score, 2> pulse_scores_;
  double sum_ = 0.0, count_ = 0.0;
};

void examine_segment(const Measurement& run, const Segment& segment, const FitPoint& point,
                     const std::vector<LinearStep>& steps, const SelectionPolicy& policy, Blocks& blocks) {
  const ResidualPolicy& residual = policy.residual;
  const bool present[2] = {run.has_cart(), run.has_theta() && point.plant.pendulum.has_value()};
  const auto length = static_cast<std::size_t>(
      std::max(residual.min_block_samples, residual.block_s / std::max(run.median_period_s(), 1e-9)));
  ProbeState state(0.5 * (run.time_s.front() + run.time_s.back()), policy.motion);
  ProbeValues acting{};
  BlockSums sums;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const LinearStep& step = steps[k];
    if (k > 0) sums.advance(step, acting);
    for (int channel = 0; channel < 2; ++channel)
      if (present[channel]) sums.add(step, channel, acting);
    acting = state.at(run.time_s[segment.first + k], step.period_s, step.rate[0], step.rate[1],
                      run.voltage_v[segment.first + k]);
    if ((k + 1) % length == 0)
      sums.close(
          {is_visible(run, step, point.noise, 0, residual), is_visible(run, step, point.noise, 1, residual)},
          residual, blocks);
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
  return normal_deviate(t, freedom);
}

/// Share of the innovations' power that a probe accounts for.
double share_of(const std::vector<Score>& scores, double power) {
  const Score sum = sum_of(scores);
  return sum.information > 0.0 && power > 0.0 ? sum.score * sum.score / (sum.information * power) : 0.0;
}

/// How large pulses are at most, in standard errors: their root mean square, or what most of them are with
/// as much more as chance makes of so few. 1 of too few to say.
double largest_size(const std::vector<double>& pulses, const ResidualPolicy& policy) {
  if (pulses.size() < policy.min_pulses) return 1.0;
  double sum = 0.0;
  for (const double p : pulses) sum += p * p;
  return std::min(std::sqrt(sum / static_cast<double>(pulses.size())),
                  policy.pulses_by_chance * robust_deviation(pulses));
}

}  // namespace

ResidualTests examine_residuals(const FitData& data, const FitPoint& point, const SelectionPolicy& policy) {
  const ResidualPolicy& residual = policy.residual;
  const std::vector<std::vector<LinearStep>> steps = linearise(data, point);
  Blocks blocks;
  for (std::size_t s = 0; s < steps.size(); ++s)
    examine_segment((*data.runs)[data.segments[s].run], data.segments[s], point, steps[s], policy, blocks);
  ResidualTests result;
  if (blocks.rms.size() >= residual.min_blocks) {
    std::sort(blocks.rms.begin(), blocks.rms.end());
    result.dispersion = blocks.rms[blocks.rms.size() * residual.large_block_percentile / 100] /
                        std::max(blocks.rms[blocks.rms.size() / 2], 1e-12);
  }
  const Tails force = tails_of(blocks.pulses[0]), torque = tails_of(blocks.pulses[1]);
  result.tails = torque.certainty > force.certainty || blocks.pulses[0].empty() ? torque : force;
  result.slow_force = std::max(1.0, robust_deviation(blocks.pulses[0]));
  result.slow_torque = std::max(1.0, robust_deviation(blocks.pulses[1]));
  result.quick = std::min(largest_size(blocks.pulses[0], residual), largest_size(blocks.pulses[1], residual));
  // Of all that are certain, the one that accounts for most is what it goes with; else the most certain.
  double largest_share = 0.0;
  for (std::size_t i = 0; i < probes.size(); ++i) {
    const double certainty = certainty_of(blocks.probe[i]), share = share_of(blocks.probe[i], blocks.power);
    if (is_sensor(probes[i].on) && share < residual.min_sensor_share) continue;
    const bool certain = certainty > residual.min_dependence;
    if (certain ? share <= largest_share : certainty <= result.certainty) continue;
    if (certain) largest_share = share;
    result.certainty = certainty;
    const bool along = sum_of(blocks.probe[i]).score > 0.0;
    result.depends_on = std::string(probes[i].name) + " " + std::string(place_of(probes[i].on)) +
                        (along ? probes[i].looks_like : probes[i].turned_round);
  }
  return result;
}

Noise low_frequency_equivalent(Noise noise, const ResidualTests& tests) {
  noise.force *= tests.slow_force;
  noise.coloured_force_n *= tests.slow_force;
  noise.torque *= tests.slow_torque;
  noise.coloured_torque_nm *= tests.slow_torque;
  return noise;
}

}  // namespace upright
