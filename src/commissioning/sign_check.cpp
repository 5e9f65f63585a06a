#include "sign_check.hpp"

#include <algorithm>
#include <cmath>

namespace upright {

namespace {

/// One pulse of a check: what the cart and the pendulum did in the fifth of a second from its start.
struct Pulse {
  double voltage_v = 0.0, cart_m = 0.0, lean_rad = 0.0;
};

std::vector<Pulse> pulses_in(const std::vector<LogRecord>& rows) {
  constexpr std::int64_t window_ns = 200'000'000;
  std::vector<Pulse> pulses;
  for (std::size_t k = 1; k < rows.size(); ++k) {
    if (rows[k].voltage_v == 0.0 || rows[k - 1].voltage_v != 0.0) continue;
    Pulse pulse{rows[k].voltage_v, 0.0, 0.0};
    for (std::size_t j = k; j < rows.size() && rows[j].time_ns < rows[k].time_ns + window_ns; ++j) {
      const double lean = rows[j].theta_rad - rows[k].theta_rad;
      if (std::abs(lean) > std::abs(pulse.lean_rad)) pulse.lean_rad = lean;
      pulse.cart_m = rows[j].cart_m - rows[k].cart_m;
    }
    pulses.push_back(pulse);
  }
  return pulses;
}

}  // namespace

SignFinding judge_signs(const std::vector<LogRecord>& rows, bool has_pendulum) {
  constexpr double felt_m = 0.002, felt_rad = 0.005;
  int cart_with = 0, cart_against = 0, lag = 0, lead = 0;
  for (const Pulse& pulse : pulses_in(rows)) {
    if (std::abs(pulse.cart_m) < felt_m) continue;
    ++(pulse.cart_m * pulse.voltage_v > 0.0 ? cart_with : cart_against);
    // The bob stays behind: past hanging the angle grows when the cart goes toward +x.
    if (std::abs(pulse.lean_rad) > felt_rad) ++(pulse.lean_rad * pulse.cart_m > 0.0 ? lag : lead);
  }
  if (cart_with + cart_against < 2)
    return {false, "the cart hardly moved: check the amplifier, its cable and largest_v"};
  if (cart_with > 0 && cart_against > 0)
    return {false, "the cart moved in both directions under the same voltage: check the cart encoder"};
  if (cart_against > 0)
    return {false,
            "positive voltage moved the cart toward -x: reverse amplifier.sign, or calibration.cart.sign if "
            "+x is the other direction"};
  if (has_pendulum && lag + lead < 2)
    return {false, "the pendulum hardly moved when the cart did: check the pendulum encoder"};
  if (has_pendulum && lag > 0 && lead > 0)
    return {false, "the pendulum was already swinging: let it hang still and repeat the check"};
  if (has_pendulum && lead > 0)
    return {false, "the pendulum leaned ahead of the cart: reverse calibration.pendulum.sign"};
  return {true, "positive voltage moves the cart toward +x" +
                    std::string(has_pendulum ? ", and the hanging pendulum lags behind it" : "")};
}

}  // namespace upright
