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
#include "upright/hal/comedi_wiring.hpp"
#include "upright/hal/gpio.hpp"
#include "upright/hal/modbus_registers.hpp"
#include "upright/hal/quanser_wiring.hpp"

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

/// Of a serial line.
enum class Parity : std::uint8_t { none, even, odd };

/// Modbus functions that transfer counts and voltage.
enum class ModbusExchange : std::uint8_t {
  read_write,  ///< function 0x17 (holding registers only)
  separate,    ///< 0x03 or 0x04 to read, 0x10 to write
};

/// A watchdog in the device: it switches the voltage off when no valid request came within its time.
struct DeviceWatchdog {
  int address = 0;                 ///< of the holding register
  double time_s = 0.0;             ///< its time [s]
  double seconds_per_count = 0.0;  ///< seconds per count of the register

  int counts() const;  ///< its time as the register holds it
};

/// A device that samples on its own time: it answers a read of `sample_address` with its next sample.
struct DeviceSampling {
  int sample_address = 0;          ///< holding register: the sample's number
  int period_address = 0;          ///< holding register: the time between samples; 0: none are taken
  double seconds_per_count = 0.0;  ///< of that register

  /// A period as the register holds it; absent: it cannot.
  std::optional<int> counts(double period_s) const;
};

/// Section `modbus` of a rig file.
struct ModbusRig {
  std::string host;                 ///< modbus-tcp
  int port = 502;                   ///< modbus-tcp
  std::string device;               ///< modbus-rtu: the serial line
  int baud = 0;                     ///< modbus-rtu
  Parity parity = Parity::none;     ///< of the serial line
  int stop_bits = 1;                ///< of the serial line, 1 or 2
  int unit = 1;                     ///< address of the device
  double response_timeout_s = 0.0;  ///< per exchange; the factory checks it against the period
  ModbusExchange exchange = ModbusExchange::read_write;  ///< how counts and voltage are transferred
  // The following keys are present as far as the device is used: no counters where only the voltage uses
  // Modbus, no voltage where only the encoders do and `exchange` does not need one.
  bool input_registers = false;  ///< counters are input registers (0x04)
  int cart_address = 0;          ///< of the cart's counter
  int pendulum_address = 0;      ///< of the pendulum's counter
  CounterFormat counter;         ///< of both counters
  int voltage_address = 0;       ///< of the voltage's holding register
  VoltageFormat voltage;         ///< what the voltage's registers hold
  /// False: the voltage registers do not read back as the output, so that a stop does not read them.
  bool voltage_reads_back = true;
  std::optional<int> enable_address;      ///< holding register: 1 enables the amplifier, 0 disables it
  std::optional<int> boot_count_address;  ///< same table as the counters: changes when the device restarts
  /// Same table as the counters: why the device has stopped the motor itself, see fault_in_status().
  std::optional<int> status_address;
  std::optional<DeviceWatchdog> watchdog;  ///< absent: the device has none
  std::optional<DeviceSampling> sampling;  ///< absent: the loop follows the computer's clock
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
