// Statistics of the innovations of a filter, of what was measured or of what the fitted model draws. Under
// the right model the innovations are white, in open and in closed loop alike. (A residual force is not: the
// loop answers it, so that it goes with the voltage whatever it is.)
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "estimation/fit.hpp"
#include "selection_policy.hpp"

namespace upright {

/// How the innovations may depend on what was measured: forces that no effect of the registry has (that drift
/// with time, friction that changes with time, what fades after a reversal), and shifts of what a sensor
/// shows that go with the voltage or the direction (a drive that gives way or has play between the encoder
/// and what it measures).
inline constexpr std::size_t residual_probe_count = 14;

/// Arrays of two are of short pulses: a force on the cart and a torque on the pendulum. NaN where none of
/// them would move its sensor.
struct InnovationStatistics {
  static constexpr double not_shown = std::numeric_limits<double>::quiet_NaN();
  // What grows with the speed of the cart or pendulum is taken out of these before their tails are compared:
  // a disturbance may be larger in fast motion.
  /// [1] 95th percentile of the blocks' rms over its median. 1 if there are no blocks.
  double dispersion = 1.0;
  /// [1] Of the pulses, fitted block by block; 3 for a Gaussian.
  std::array<double, 2> kurtosis{not_shown, not_shown};
  /// [1] Of the disturbance with a memory that the filter estimates, block by block; 3 for a Gaussian. NaN of
  /// a filter that estimates none.
  std::array<double, 2> disturbance_kurtosis{not_shown, not_shown};
  /// [1] Over a tenth of a second and more: the size of most pulses over that which white noise that accounts
  /// for single samples makes of them.
  std::array<double, 2> pulse_size{not_shown, not_shown};
  /// [standard errors] How certainly the innovations go with each probe; 0 of a shift of a sensor that
  /// accounts for too little.
  std::array<double, residual_probe_count> dependence{};
  /// [1] The share of the innovations' power that each accounts for.
  std::array<double, residual_probe_count> share{};
  /// The sign of each.
  std::array<bool, residual_probe_count> is_positive{};

  /// Of those that show certainly, the one that accounts for most; else the most certain.
  std::size_t named_probe = 0;

  double largest_dependence() const;
};

/// What a probe is, and where it acts: in which equation or sensor.
std::string name_of_residual_probe(std::size_t probe, bool is_positive);

/// The innovations of a fit, and what each probe and pulse would show in them: the same for what was measured
/// and for what is drawn.
class Innovations {
 public:
  Innovations(const FitData& data, const FitPoint& point, const SelectionPolicy& policy);

  InnovationStatistics measured() const;
  /// Of innovations drawn from the fitted model: they are white. `seed` is the number of the draw.
  InnovationStatistics drawn(std::uint64_t seed) const;

 private:
  static constexpr std::size_t response_count = residual_probe_count + 2;
  using Responses = std::array<double, response_count>;

  /// One innovation.
  struct Row {
    std::size_t channel;  ///< 0: cart, 1: pendulum
    double normalised;    ///< measured, in its standard deviations
    double weight;
    Responses responses;  ///< scores per normalised innovation
    /// Of the estimated disturbances, what remains since the row before, and what a normalised innovation
    /// adds to each [N, N m].
    double keeps = 1.0;
    std::array<double, 2> adds{};
  };
  /// Consecutive innovations of one segment.
  struct Block {
    std::size_t end;              ///< number of the first row after it
    bool counts;                  ///< nothing is held, and it moves more than an encoder step
    std::array<bool, 2> visible;  ///< whether a pulse moves its sensor
    std::array<double, 2> speed;  ///< rms of the cart's and of the pendulum's [m/s, rad/s]
    Responses information;
  };
  class Collector;

  void examine_segment(const Measurement& run, const Segment& segment, const FitPoint& point,
                       const std::vector<LinearStep>& steps, const SelectionPolicy& policy);
  template <class Normalised>
  InnovationStatistics statistics_of(Normalised normalised) const;

  std::vector<Row> rows_;
  std::vector<Block> blocks_;
  double min_sensor_share_, min_dependence_;
  std::size_t large_block_percentile_;
};

}  // namespace upright
