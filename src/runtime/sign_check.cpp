#include "upright/runtime/sign_check.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "upright/model/error.hpp"
#include "upright/model/input_file.hpp"
#include "upright/model/yaml_reader.hpp"

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
    return {false, "the cart hardly moved: check amplifier, cable and largest_v"};
  if (cart_with > 0 && cart_against > 0)
    return {false, "the cart moved both ways under the same voltage: check the cart's encoder"};
  if (cart_against > 0)
    return {false,
            "positive voltage moved the cart toward -x: turn amplifier.sign, or calibration.cart.sign where "
            "+x is "
            "the other side"};
  if (has_pendulum && lag + lead < 2)
    return {false, "the pendulum hardly moved when the cart did: check its encoder"};
  if (has_pendulum && lag > 0 && lead > 0)
    return {false, "the pendulum swung on its own: let it hang still and repeat the check"};
  if (has_pendulum && lead > 0)
    return {false, "the pendulum leaned ahead of the cart: turn calibration.pendulum.sign"};
  return {true, "positive voltage moves the cart toward +x" +
                    std::string(has_pendulum ? ", and the hanging pendulum lags behind it" : "")};
}

std::filesystem::path sign_record_of(const RigFile& rig) {
  return rig.file.string() + ".signs";
}

bool signs_are_checked(const RigFile& rig) {
  if (const auto in = InputFile::if_there(sign_record_of(rig)); !in) return false;
  const std::string text = whole_file(sign_record_of(rig));
  const std::size_t body = text.find('\n');
  return body != std::string::npos && text.substr(body + 1) == wiring_of(rig);
}

void require_checked_signs(const RigFile& rig, const std::string& otherwise) {
  if (is_simulated(rig) || signs_are_checked(rig)) return;
  throw ConfigError("no sign check was done on this rig as it is wired (there is no matching " +
                    sign_record_of(rig).string() +
                    "), and with a wrong sign the loop drives the cart into the end stop: run upright "
                    "experiment config/experiments/sign-check.yaml --rig " +
                    rig.file.string() + " first" + otherwise);
}

void write_sign_record(const RigFile& rig, const std::string& sentence) {
  const std::filesystem::path file = sign_record_of(rig);
  std::ofstream out(file, std::ios::binary);
  out << "# Signs checked: " << sentence << ". Of this wiring:\n" << wiring_of(rig);
  out.close();
  if (!out) throw ConfigError("cannot write " + file.string() + ": make the folder of the rig file writable");
}

}  // namespace upright
