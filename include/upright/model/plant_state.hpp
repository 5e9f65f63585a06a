// The state of a plant and the modes of its dry contacts.
#pragma once

#include <cstdint>

namespace upright {

/// State of the plant. `motor_v` is used with motor_lag only, `bristle_m` with bristle_friction only,
/// `attached_m` and `attached_mps` with sprung_mass, backlash or flexible_rod only.
template <class S>
struct PlantState {
  S cart_m{};        ///< position of the cart, with lost_counts as its counter shows it [m]
  S theta_rad{};     ///< angle of the pendulum [rad], 0 upright
  S cart_mps{};      ///< velocity of the cart [m/s]
  S theta_radps{};   ///< rate of the pendulum [rad/s]
  S motor_v{};       ///< motor voltage after the motor lag [V]
  S bristle_m{};     ///< deflection of the bristles [m]
  S attached_m{};    ///< position of the attached mass relative to cart or rod, 0 at rest [m]
  S attached_mps{};  ///< velocity of the attached mass relative to cart or rod [m/s]
};

/// Mode of a contact with dry friction: sticking, or sliding in one direction.
enum class Contact : std::int8_t { slip_backward = -1, stick = 0, slip_forward = 1 };

/// The modes of both dry contacts.
struct Contacts {
  Contact cart = Contact::slip_forward;   ///< between cart and track
  Contact pivot = Contact::slip_forward;  ///< in the pivot
};

}  // namespace upright
