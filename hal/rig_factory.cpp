#include "upright/hal/rig_factory.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "backends.hpp"
#include "gpio_rig.hpp"
#include "guarded_rig.hpp"
#include "joined_rig.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

/// The fewest bytes that a period sends over a serial line: reading the counters and writing the voltage.
int min_bytes(const RigFile& rig) {
  const ModbusRig& modbus = *rig.modbus;
  const RigRoles roles = roles_of(rig, Backend::modbus_rtu);
  const int counters = static_cast<int>(roles.cart) + static_cast<int>(roles.pendulum);
  const int voltage = 2 * modbus.voltage.registers();
  const int asked = modbus.exchange == ModbusExchange::read_write ? 13 + voltage : 8;
  const int answered = 5 + 2 * counters * modbus.counter.registers;
  // The exchange that waits for a sample of the device carries the voltage too.
  const int written = roles.output && !modbus.sampling ? 9 + voltage + 8 : 0;
  return asked + answered + written;
}

/// What a period's bytes take on a serial line, without any pause between them [s].
double line_time_s(const RigFile& rig) {
  const ModbusRig& modbus = *rig.modbus;
  const int bits_per_byte = 1 + 8 + (modbus.parity == Parity::none ? 0 : 1) + modbus.stop_bits;
  return static_cast<double>(min_bytes(rig) * bits_per_byte) / modbus.baud;
}

}  // namespace

void require_link_fits(const RigFile& rig, double period_s) {
  const std::string file = rig.file.string() + ":1: ";
  const std::string period = "the period of " + exact_text(period_s) + " s";
  // Each cycle serves the card's watchdog once, and a cycle may come late.
  constexpr double min_periods = 2.0;
  if (rig.quanser && rig.quanser->watchdog_s > 0.0 && rig.quanser->watchdog_s < min_periods * period_s)
    throw ConfigError(file + "quanser_hil.watchdog_s is " + exact_text(rig.quanser->watchdog_s) +
                      ", less than twice " + period +
                      ": raise sample_rate_hz in the gain file, or set quanser_hil.watchdog_s to at least " +
                      exact_text(min_periods * period_s));
  if (!rig.modbus || is_simulated(rig)) return;
  if (rig.modbus->response_timeout_s >= period_s)
    throw ConfigError(
        file + "modbus.response_timeout_s is " + exact_text(rig.modbus->response_timeout_s) +
        ", which is not less than " + period +
        ": lower sample_rate_hz in the gain file, or reduce modbus.response_timeout_s below it");
  if (rig.modbus->sampling && !rig.modbus->sampling->counts(period_s))
    throw ConfigError(
        file + "modbus.device_clock.seconds_per_count is " +
        exact_text(rig.modbus->sampling->seconds_per_count) + ", of which " + period +
        " is not a whole number up to 65535: give sample_rate_hz in the gain file another value, or remove "
        "modbus.device_clock");
  if (!rig.modbus->device.empty() && line_time_s(rig) >= period_s)
    throw ConfigError(file + "modbus.baud is " + std::to_string(rig.modbus->baud) +
                      ", at which one period's bytes take " + exact_text(line_time_s(rig)) +
                      " s, which is not less than " + period +
                      ": lower sample_rate_hz in the gain file, or raise modbus.baud");
}

std::unique_ptr<Rig> assembled(std::unique_ptr<Rig> parts, const RigFile& rig) {
  return with_gpio_lines(guarded(std::move(parts), calibration_in_use(rig)), rig);
}

std::unique_ptr<Rig> make_rig(const RigFile& rig, const RigOptions& options) {
  require_link_fits(rig, options.period_s);
  std::vector<Backend> backends;
  for (const Backend backend : {rig.output, rig.cart_encoder, rig.pendulum_encoder})
    if (std::find(backends.begin(), backends.end(), backend) == backends.end()) backends.push_back(backend);
  std::vector<RigPart> parts;
  parts.reserve(backends.size());
  for (const Backend backend : backends) {
    std::unique_ptr<Rig> part =
        all_backends.at(static_cast<std::size_t>(backend))().make(rig, options.period_s);
    parts.push_back({std::move(part), roles_of(rig, backend)});
  }
  std::unique_ptr<Rig> whole =
      parts.size() == 1 ? std::move(parts.front().rig) : joined(std::move(parts), options.period_s);
  return assembled(std::move(whole), rig);
}

}  // namespace upright
