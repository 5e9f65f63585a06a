// The registration of all effects, one line each, in the order of documents and candidates.
#pragma once

#include <tuple>

#include "upright/model/effects/angle_offset.hpp"
#include "upright/model/effects/angle_scale.hpp"
#include "upright/model/effects/back_emf.hpp"
#include "upright/model/effects/backlash.hpp"
#include "upright/model/effects/bristle_friction.hpp"
#include "upright/model/effects/cable_spring.hpp"
#include "upright/model/effects/cart_mass.hpp"
#include "upright/model/effects/cart_scale.hpp"
#include "upright/model/effects/cogging_force.hpp"
#include "upright/model/effects/constant_force.hpp"
#include "upright/model/effects/coulomb_friction.hpp"
#include "upright/model/effects/drive_compliance.hpp"
#include "upright/model/effects/encoder_eccentricity.hpp"
#include "upright/model/effects/flexible_rod.hpp"
#include "upright/model/effects/force_table.hpp"
#include "upright/model/effects/friction_asymmetry.hpp"
#include "upright/model/effects/input_delay.hpp"
#include "upright/model/effects/load_dependent_friction.hpp"
#include "upright/model/effects/lost_counts.hpp"
#include "upright/model/effects/motor_lag.hpp"
#include "upright/model/effects/pendulum_length.hpp"
#include "upright/model/effects/pendulum_mass.hpp"
#include "upright/model/effects/pivot_coulomb_friction.hpp"
#include "upright/model/effects/pivot_quadratic_drag.hpp"
#include "upright/model/effects/pivot_viscous_friction.hpp"
#include "upright/model/effects/position_dependent_friction.hpp"
#include "upright/model/effects/quadratic_drag.hpp"
#include "upright/model/effects/sprung_mass.hpp"
#include "upright/model/effects/stribeck_friction.hpp"
#include "upright/model/effects/torque_ripple.hpp"
#include "upright/model/effects/velocity_ripple.hpp"
#include "upright/model/effects/viscous_asymmetry.hpp"
#include "upright/model/effects/viscous_friction.hpp"
#include "upright/model/effects/voltage_dead_zone.hpp"
#include "upright/model/effects/voltage_gain.hpp"
#include "upright/model/effects/voltage_offset.hpp"
#include "upright/model/effects/voltage_saturation.hpp"
#include "upright/model/effects/warming_friction.hpp"

namespace upright {

// clang-format off
/// Every effect of this build.
using AllEffects =
    std::tuple<effects::ViscousFriction,
               effects::CoulombFriction,
               effects::FrictionAsymmetry,
               effects::ViscousAsymmetry,
               effects::StribeckFriction,
               effects::PositionDependentFriction,
               effects::WarmingFriction,
               effects::LoadDependentFriction,
               effects::BristleFriction,
               effects::QuadraticDrag,
               effects::ConstantForce,
               effects::CableSpring,
               effects::SprungMass,
               effects::CoggingForce,
               effects::VelocityRipple,
               effects::TorqueRipple,
               effects::VoltageSaturation,
               effects::VoltageDeadZone,
               effects::VoltageGain,
               effects::VoltageOffset,
               effects::InputDelay,
               effects::MotorLag,
               effects::Backlash,
               effects::PivotViscousFriction,
               effects::PivotCoulombFriction,
               effects::PivotQuadraticDrag,
               effects::FlexibleRod,
               effects::DriveCompliance,
               effects::AngleOffset,
               effects::EncoderEccentricity,
               effects::LostCounts,
               effects::CartScale,
               effects::AngleScale,
               effects::CartMass,
               effects::PendulumMass,
               effects::PendulumLength,
               effects::BackEmf,
               effects::ForceTable>;
// clang-format on

}  // namespace upright
