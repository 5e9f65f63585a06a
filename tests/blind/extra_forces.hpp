// Forces on a rig that no plant file has, and the reference engine under them.
#pragma once

#include <optional>
#include <vector>

#include "blind_run.hpp"
#include "coloured_noise.hpp"
#include "sim/cvode_engine.hpp"

namespace upright::blind {

/// How often forces that vary are given a new value.
inline constexpr double force_step_s = 1e-3;

/// The unmodelled forces of one run.
class ExtraForces {
 public:
  ExtraForces(const Rig& rig, const Plan& plan);

  /// Whether anything acts that the rig's plant does not have.
  bool varies() const { return varies_; }

  /// The force on the cart beside the plant's.
  double cart_force_n(double time_s, const PlantState<double>& state) const;
  double pivot_torque_nm(double time_s) const;

  /// The plant with that force in it.
  Plant plant_at(double time_s, const PlantState<double>& state) const;

 private:
  void add_white_bandwidth(std::mt19937_64& random);
  void add_coloured(std::uint64_t seed);
  void add_gusts(std::mt19937_64& random);
  std::size_t index_at(double time_s) const;

  const Rig& rig_;
  double duration_s_;
  bool varies_ = false;
  std::vector<double> force_, coloured_, torque_;
  RoughTrack rough_, unknown_rough_;
};

/// The reference engine on a plant that changes from millisecond to millisecond.
class VaryingEngine {
 public:
  VaryingEngine(const PlantModel<double>& model, const EngineOptions& options)
      : locked_(model.cart_locked), options_(options), engine_(model, options) {}

  void vary(const ExtraForces* extra) { extra_ = extra; }

  void start(const PlantState<double>& state, double time_s, double volts) {
    engine_.start(state, time_s, volts);
  }

  void advance(double duration_s, double volts);

  const Dynamics<double>& dynamics() const { return engine_.dynamics(); }
  const PlantState<double>& state() const { return engine_.state(); }
  Outputs<double> outputs() const { return engine_.outputs(); }

 private:
  bool locked_;
  EngineOptions options_;
  CvodeEngine engine_;
  const ExtraForces* extra_ = nullptr;
  double cell_ = -1.0;
};

}  // namespace upright::blind
