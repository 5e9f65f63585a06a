// Gain files (interface: "Gain file"): read strictly, written so that they read back exactly.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "upright/control/velocity_estimator.hpp"
#include "upright/model/yaml_reader.hpp"

namespace upright {

/// V = cart_position x + pendulum_angle theta + cart_velocity x' + pendulum_rate theta'.
struct Gains {
  double cart_position_v_per_m = 0.0;
  double pendulum_angle_v_per_rad = 0.0;
  double cart_velocity_v_per_mps = 0.0;
  double pendulum_rate_v_per_radps = 0.0;
};

enum class CompensationKind : std::uint8_t { none, predictor };

/// How the configured delay is made up for.
struct DelayCompensation {
  CompensationKind kind = CompensationKind::none;
  std::filesystem::path
      plant;  ///< predictor only: the model it predicts with, resolved against the gain file
};

/// Everything a controller is made of: V(t) = gains . [x, theta, x', theta'](t - delay_s).
struct ControlConfig {
  Gains gains;
  double delay_s = 0.0;
  double sample_rate_hz = 1000.0;
  EstimatorConfig estimator;
  DelayCompensation compensation;

  double period_s() const { return 1.0 / sample_rate_hz; }
};

inline constexpr double lowest_sample_rate_hz = 1.0;
inline constexpr double highest_sample_rate_hz = 20000.0;

/// Reads a gain file. Throws ConfigError with remedy, file, line and key.
ControlConfig read_gain_file(const std::filesystem::path& file);

/// Reads the same keys from a map that is already parsed, and refuses every other key in it.
ControlConfig read_gains(const YamlMap& document);

/// The gain file as text. `comments` become lines at its top.
std::string gain_text(const ControlConfig& config, const std::vector<std::string>& comments = {});

/// Writes the gain file; an existing file is replaced. Throws Error when it cannot be written.
void write_gain_file(const ControlConfig& config, const std::filesystem::path& file,
                     const std::vector<std::string>& comments = {});

}  // namespace upright
