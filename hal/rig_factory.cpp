#include "upright/hal/rig_factory.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "comedi/comedi_rig.hpp"
#include "joined_rig.hpp"
#include "modbus/modbus_rig.hpp"
#include "upright/hal/gpio_rig.hpp"
#include "upright/hal/guarded_rig.hpp"
#include "upright/model/error.hpp"

namespace upright {

namespace {

std::unique_ptr<Rig> make_modbus(const RigFile& rig, double period_s) {
  if (rig.modbus->response_timeout_s >= period_s)
    throw ConfigError("give modbus.response_timeout_s less than the period of " + exact_text(period_s) +
                      " s, or lower sample_rate_hz in the gain file: " + rig.file.string() +
                      ":1: modbus.response_timeout_s is " + exact_text(rig.modbus->response_timeout_s));
  return std::make_unique<ModbusTransport>(rig, period_s);
}

std::unique_ptr<Rig> make_part(const RigFile& rig, Backend backend, double period_s) {
  switch (backend) {
    case Backend::modbus_tcp:
    case Backend::modbus_rtu:
      return make_modbus(rig, period_s);
    case Backend::gpio:
      return make_gpio_encoders(rig, period_s);
    case Backend::comedi:
      return std::make_unique<ComediTransport>(rig, period_s);
    case Backend::simulated:
      break;
  }
  throw ConfigError("name a hardware backend: " + rig.file.string() + ":1: backend is simulated");
}

}  // namespace

std::unique_ptr<Rig> make_rig(const RigFile& rig, const RigOptions& options) {
  std::vector<Backend> backends;
  for (const Backend backend : {rig.output, rig.cart_encoder, rig.pendulum_encoder})
    if (std::find(backends.begin(), backends.end(), backend) == backends.end()) backends.push_back(backend);
  std::vector<RigPart> parts;
  parts.reserve(backends.size());
  for (const Backend backend : backends) {
    std::unique_ptr<Rig> part = make_part(rig, backend, options.period_s);
    parts.push_back({std::move(part), roles_of(rig, backend)});
  }
  std::unique_ptr<Rig> whole =
      parts.size() == 1 ? std::move(parts.front().rig) : joined(std::move(parts), options.period_s);
  return with_gpio_lines(guarded(std::move(whole), rig.calibration), rig);
}

}  // namespace upright
