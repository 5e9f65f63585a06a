// What the sensors show of the position of the drive and the angle of the pendulum, before quantisation.
#pragma once

#include "upright/model/effect_hooks.hpp"
#include "upright/model/plant_model.hpp"

namespace upright {

/// The outputs of sensors whose encoder of the cart runs true: linear in position and angle.
template <class S>
Outputs<S> outputs_of_true_encoder(const PlantModel<S>& model, const S& drive_m, const S& theta_rad) {
  Outputs<S> outputs{drive_m, theta_rad};
  for (int stage = 1; stage <= 2; ++stage)
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (requires { E::sensor_stage; })
        if (E::sensor_stage == stage && model.present.template has<I>())
          E::measure(model.template of<I>(), outputs);
    });
  return outputs;
}

/// What the pinion of the cart's encoder says too much at this position of the drive [m].
template <class S>
S encoder_error_m(const PlantModel<S>& model, const S& drive_m) {
  S error_m(0.0);
  for_each_effect([&]<std::size_t I>() {
    using E = EffectAt<I>;
    if constexpr (requires { E::encoder_error_m(model.template of<I>(), drive_m); })
      if (model.present.template has<I>())
        error_m = error_m + E::encoder_error_m(model.template of<I>(), drive_m);
  });
  return error_m;
}

/// The velocity that the counter of the cart's position shows [m/s].
template <class S>
S counted_mps(const PlantModel<S>& model, S cart_mps) {
  const S true_mps = cart_mps;
  for_each_effect([&]<std::size_t I>() {
    if constexpr (has_lost_counts<EffectAt<I>, S>)
      if (model.present.template has<I>())
        cart_mps = cart_mps - EffectAt<I>::lost_mps(model.template of<I>(), true_mps);
  });
  return cart_mps;
}

/// The outputs of the sensors.
template <class S>
Outputs<S> sensor_outputs(const PlantModel<S>& model, const S& drive_m, const S& theta_rad) {
  return outputs_of_true_encoder(model, S(drive_m + encoder_error_m(model, drive_m)), theta_rad);
}

/// The position of the drive at which the encoder's pinion says `turned_m` [m].
inline double drive_position_m(const PlantModel<double>& model, double turned_m) {
  constexpr int max_steps = 60;  // each at least halves the error: a share is at most 0.5
  double drive_m = turned_m;
  for (int i = 0; i < max_steps; ++i) {
    const double former_m = drive_m;
    drive_m = turned_m - encoder_error_m(model, drive_m);
    if (drive_m == former_m) break;
  }
  return drive_m;
}

/// The outputs as linear functions of position and angle, of an encoder that runs true.
template <class S>
struct SensorLine {
  S cart_gain;         ///< metres shown per metre
  S theta_gain;        ///< radians shown per radian
  S cart_offset_m;     ///< shown at x = 0
  S theta_offset_rad;  ///< shown at theta = 0

  /// Of a plant.
  explicit SensorLine(const PlantModel<S>& model) {
    const Outputs<S> zero = outputs_of_true_encoder(model, S(0.0), S(0.0));
    const Outputs<S> one = outputs_of_true_encoder(model, S(1.0), S(1.0));
    cart_gain = one.cart_m - zero.cart_m;
    theta_gain = one.theta_rad - zero.theta_rad;
    cart_offset_m = zero.cart_m;
    theta_offset_rad = zero.theta_rad;
  }
};

}  // namespace upright
