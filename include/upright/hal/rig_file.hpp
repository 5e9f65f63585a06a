// Rig files (interface: "Rig file"): which backend, how it is wired and calibrated, and the limits that keep
// it safe. Read strictly, written so that they read back exactly. The sample rate is the gain file's.
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

/// A backend by its place in hal/backends.hpp.
enum class Backend : std::uint8_t { simulated, modbus_tcp, modbus_rtu, gpio, comedi, quanser_hil };

/// "simulated", "modbus-tcp", ...
std::string backend_name(Backend backend);

/// What a backend does for a rig.
struct RigRoles {
  bool cart = false;      ///< counts the cart's encoder
  bool pendulum = false;  ///< counts the pendulum's encoder
  bool output = false;    ///< puts out the voltage

  bool encoders() const noexcept { return cart || pendulum; }
  bool any() const noexcept { return encoders() || output; }
  bool all() const noexcept { return cart && pendulum && output; }
};

struct Amplifier {
  double limit_v = 0.0;  ///< symmetric; commands are clamped to it
  int sign = 1;          ///< -1 where a positive command would push the cart toward -x
};

/// The simulated rig: which plant, where it starts, what its sensors and its clock do.
struct SimulatedRig {
  std::filesystem::path plant;  ///< plant file
  Pose initial;
  double initial_cart_mps = 0.0;
  double initial_theta_radps = 0.0;
  bool quantise = true;          ///< false: encoders 1024 times as fine, see calibration_in_use
  double cart_noise_m = 0.0;     ///< standard deviation, before quantisation
  double theta_noise_rad = 0.0;  ///< standard deviation, before quantisation
  double timing_jitter_s = 0.0;  ///< standard deviation of how late a reading is taken
};

enum class Parity : std::uint8_t { none, even, odd };

/// How encoders and voltage travel.
enum class ModbusExchange : std::uint8_t {
  read_write,  ///< function 0x17 (holding registers only)
  separate,    ///< 0x03 or 0x04 to read, 0x10 to write
};

/// A watchdog in the device: it takes the voltage away when no valid request came for its time.
struct DeviceWatchdog {
  int address = 0;
  double time_s = 0.0;
  double seconds_per_count = 0.0;  ///< what one count of the register means

  int counts() const;
};

struct ModbusRig {
  std::string host;    ///< modbus-tcp
  int port = 502;      ///< modbus-tcp
  std::string device;  ///< modbus-rtu: the serial line
  int baud = 0;        ///< modbus-rtu
  Parity parity = Parity::none;
  int stop_bits = 1;
  int unit = 1;
  double response_timeout_s = 0.0;  ///< per exchange; the factory checks it against the period
  ModbusExchange exchange = ModbusExchange::read_write;
  // What follows is in the file as far as the device is used: no counters where only the voltage is Modbus,
  // no voltage where only the encoders are and `exchange` does not need one.
  bool input_registers = false;  ///< counters are input registers (0x04)
  int cart_address = 0;
  int pendulum_address = 0;
  CounterFormat counter;
  int voltage_address = 0;
  VoltageFormat voltage;
  /// False: the voltage registers read back as something else than the output, so that a stop does not ask.
  bool voltage_reads_back = true;
  std::optional<int> enable_address;      ///< holding register: 1 enables the amplifier, 0 disables it
  std::optional<int> boot_count_address;  ///< same table as the counters: changes when the device restarts
  /// Same table as the counters: why the device has stopped the motor by itself, see fault_in_status().
  std::optional<int> status_address;
  std::optional<DeviceWatchdog> watchdog;
};

/// The section of a backend that has no member of its own in RigFile.
struct BackendWiring {
  virtual ~BackendWiring() = default;
};

struct RigFile {
  static constexpr double longest_watchdog_s = 10.0;  ///< a longer one watches nothing

  std::filesystem::path file;
  // Where the counts come from and where the voltage goes. Simulated is all of them or none.
  Backend cart_encoder = Backend::simulated;
  Backend pendulum_encoder = Backend::simulated;
  Backend output = Backend::simulated;
  Calibration calibration;
  Amplifier amplifier;
  double track_limit_m = 0.0;  ///< the loop stops where |x| reaches it
  /// A cart without voltage rolls on for so many seconds times its velocity: while it balances, the loop
  /// stops where it could just be halted before the track limit.
  double coast_s = 0.0;
  double fall_angle_rad = 0.0;  ///< the loop stops where |theta| reaches it
  double watchdog_s = 0.0;      ///< the motor is at zero volts this long after the last good exchange
  double spin_us = 0.0;         ///< the end of each wait that the loop spends awake, looking at the clock
  std::optional<SimulatedRig> simulated;
  std::optional<ModbusRig> modbus;
  std::optional<ComediRig> comedi;
  std::optional<QuanserRig> quanser;
  std::optional<GpioRig> gpio;
  std::shared_ptr<const BackendWiring> wiring;  ///< of any other backend, of which a rig has one at most
  std::optional<EncoderAssumptions> encoder_watch;
};

/// Reads a rig file. Throws ConfigError with remedy, file, line and key.
RigFile read_rig_file(const std::filesystem::path& file);
RigFile read_rig(const YamlMap& document);

RigRoles roles_of(const RigFile& rig, Backend backend);
bool is_simulated(const RigFile& rig);
/// For people: "modbus-tcp", or "encoders comedi, output modbus-tcp", ...
std::string backends_text(const RigFile& rig);

/// The calibration the counts of a reading follow. It is the file's, except for a simulated rig without
/// quantisation: its encoders count 1024 times as finely, in 32 bits.
Calibration calibration_in_use(const RigFile& rig);

/// The rig file as text. Paths are written as they are in `rig` (absolute or relative to the current folder).
std::string rig_text(const RigFile& rig);

/// The baud rates that both libmodbus and the kernel know; libmodbus turns any other into 9600.
bool baud_is_known(int baud);

}  // namespace upright
