#include "upright/runtime/sign_check.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "upright/model/error.hpp"

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

/// What the signs belong to.
std::string wiring_of(const RigFile& rig) {
  RigFile plain = rig;
  plain.simulated.reset();
  plain.track_limit_m = plain.fall_angle_rad = plain.watchdog_s = 1.0;
  plain.coast_s = 0.0;
  plain.amplifier.limit_v = 1.0;
  plain.calibration.zero_at_start = true;
  return rig_text(plain);
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
    return {false, "check amplifier, cable and largest_v: the cart hardly moved"};
  if (cart_with > 0 && cart_against > 0)
    return {false, "check the cart's encoder: the cart moved both ways under the same voltage"};
  if (cart_against > 0)
    return {
        false,
        "turn amplifier.sign, or calibration.cart.sign where +x is the other side: positive voltage moved "
        "the cart toward -x"};
  if (has_pendulum && lag + lead < 2)
    return {false, "check the pendulum's encoder: it hardly moved when the cart did"};
  if (has_pendulum && lag > 0 && lead > 0)
    return {false, "let it hang still and repeat the check: the pendulum swung on its own"};
  if (has_pendulum && lead > 0)
    return {false, "turn calibration.pendulum.sign: the pendulum leaned ahead of the cart"};
  return {true, "positive voltage moves the cart toward +x" +
                    std::string(has_pendulum ? ", and the hanging pendulum lags behind it" : "")};
}

std::filesystem::path sign_record_of(const RigFile& rig) {
  return rig.file.string() + ".signs";
}

bool signs_are_checked(const RigFile& rig) {
  std::ifstream in(sign_record_of(rig), std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const std::size_t body = text.find('\n');
  return body != std::string::npos && text.substr(body + 1) == wiring_of(rig);
}

void write_sign_record(const RigFile& rig, const std::string& sentence) {
  const std::filesystem::path file = sign_record_of(rig);
  std::ofstream out(file, std::ios::binary);
  out << "# Signs checked: " << sentence << ". Of this wiring:\n" << wiring_of(rig);
  out.close();
  if (!out) throw ConfigError("make the folder of the rig file writable: cannot write " + file.string());
}

}  // namespace upright
