#include "upright/hal/rig_factory.hpp"

#include "modbus/modbus_rig.hpp"
#include "upright/hal/guarded_rig.hpp"
#include "upright/model/error.hpp"

namespace upright {

std::unique_ptr<Rig> make_rig(const RigFile& rig, const RigOptions& options) {
  for (const Backend backend : {rig.encoders, rig.output})
    if (backend == Backend::gpio || backend == Backend::comedi)
      throw ConfigError("use simulated, modbus-tcp or modbus-rtu: " + rig.file.string() + ":1: backend " +
                        backend_name(backend) + " is not part of this build");
  if (rig.encoders != rig.output)
    throw ConfigError("use one backend for both: " + rig.file.string() +
                      ":1: backend encoders and output differ, which this build cannot join");
  if (!rig.modbus)
    throw ConfigError("name a hardware backend: " + rig.file.string() + ":1: backend is simulated");
  if (rig.modbus->response_timeout_s >= options.period_s)
    throw ConfigError("give modbus.response_timeout_s less than the period of " +
                      exact_text(options.period_s) +
                      " s, or lower sample_rate_hz in the gain file: " + rig.file.string() +
                      ":1: modbus.response_timeout_s is " + exact_text(rig.modbus->response_timeout_s));
  return guarded(std::make_unique<ModbusTransport>(rig, options.period_s), rig.calibration);
}

}  // namespace upright
