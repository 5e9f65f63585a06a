// Rig files (docs/reference/rig-files.md): backends, wiring, calibration and safety limits. Read
// strictly; written files read back exactly. The sample rate belongs to the gain file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "upright/base/yaml_reader.hpp"
#include "upright/control/encoder_assumptions.hpp"
#include "upright/hal/calibration.hpp"
#include "upright/hal/wiring.hpp"

namespace upright {

/// A backend; the order is that of hal/backends.hpp.
enum class Backend : std::uint8_t { simulated, modbus_tcp, modbus_rtu, gpio, comedi, quanser_hil };

/// "simulated", "modbus-tcp", ...
std::string backend_name(Backend backend);

/// The functions that a backend has in a rig.
struct RigRoles {
  bool cart = false;      ///< counts the cart's encoder
  bool pendulum = false;  ///< counts the pendulum's encoder
  bool output = false;    ///< puts out the voltage

  bool encoders() const noexcept { return cart || pendulum; }       ///< counts at least one encoder
  bool any() const noexcept { return encoders() || output; }        ///< has at least one role
  bool all() const noexcept { return cart && pendulum && output; }  ///< has every role
};

/// Section `amplifier` of a rig file.
struct Amplifier {
  double limit_v = 0.0;  ///< symmetric limit of commands
  int sign = 1;          ///< -1 where a positive command would push the cart toward -x
};

/// The simulated rig: plant, initial state, sensors and clock.
struct SimulatedRig {
  std::filesystem::path plant;       ///< plant file
  Pose initial;                      ///< pose at the start
  double initial_cart_mps = 0.0;     ///< velocity of the cart at the start [m/s]
  double initial_theta_radps = 0.0;  ///< rate of the pendulum at the start [rad/s]
  bool quantise = true;          ///< false: encoders with 1024 times the resolution, see calibration_in_use
  double cart_noise_m = 0.0;     ///< standard deviation, before quantisation
  double theta_noise_rad = 0.0;  ///< standard deviation, before quantisation
  double timing_jitter_s = 0.0;  ///< standard deviation of the delay of readings
};

/// The section of a backend that has no own member in RigFile.
struct BackendWiring {
  virtual ~BackendWiring() = default;
};

/// A rig file.
struct RigFile {
  static constexpr double longest_watchdog_s = 10.0;  ///< a longer watchdog would offer no protection

  std::filesystem::path file;  ///< as it was named
  // The sources of counts and the destination of the voltage. Simulated applies to all of them or none.
  Backend cart_encoder = Backend::simulated;      ///< who counts the cart's encoder
  Backend pendulum_encoder = Backend::simulated;  ///< who counts the pendulum's encoder
  Backend output = Backend::simulated;            ///< who puts out the voltage
  Calibration calibration;                        ///< from counts to metres and radians
  Amplifier amplifier;                            ///< limit and sign of the voltage
  double track_limit_m = 0.0;                     ///< the loop stops where |x| reaches it
  /// Without voltage, a cart coasts for this many seconds times its velocity: while balancing, the loop
  /// stops where the cart can just be halted before the track limit.
  double coast_s = 0.0;
  double fall_angle_rad = 0.0;  ///< the loop stops where |theta| reaches it
  double watchdog_s = 0.0;      ///< the motor is at zero volts this long after the last good exchange
  double spin_us = 0.0;         ///< final part of each wait in which the loop polls the clock
  std::optional<SimulatedRig> simulated;           ///< of backend simulated
  std::optional<ModbusRig> modbus;                 ///< of backends modbus-tcp and modbus-rtu
  std::optional<ComediRig> comedi;                 ///< of backend comedi
  std::optional<QuanserRig> quanser;               ///< of backend quanser-hil
  std::optional<GpioRig> gpio;                     ///< digital lines of any rig
  std::shared_ptr<const BackendWiring> wiring;     ///< of any other backend; a rig has one at most
  std::optional<StatedAssumptions> encoder_watch;  ///< widens what the plant implies
};

/// Reads a rig file. Throws ConfigError with remedy, file, line and key.
RigFile read_rig_file(const std::filesystem::path& file);
RigFile read_rig(const YamlMap& document);  ///< the same for a file that was opened already

RigRoles roles_of(const RigFile& rig, Backend backend);  ///< what this backend does in the rig
bool is_simulated(const RigFile& rig);  ///< whether the plant is simulated: then all of the rig is
/// For messages: "modbus-tcp", or "encoders comedi, output modbus-tcp", ...
std::string backends_text(const RigFile& rig);

/// The calibration of the counts of a reading: that of the file. A simulated rig without quantisation has
/// 32-bit encoders with 1024 times the resolution.
Calibration calibration_in_use(const RigFile& rig);

/// The rig file as text. Paths are written as in `rig` (absolute or relative to the current folder).
std::string rig_text(const RigFile& rig);

/// The baud rates that libmodbus and the kernel both support; libmodbus replaces any other by 9600.
bool baud_is_known(int baud);

}  // namespace upright
