// Wiring of a rig to its devices: the sections `modbus`, `comedi`, `gpio` and `quanser_hil` of a rig file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace upright {

/// Which of two registers has the upper half.
enum class WordOrder : std::uint8_t { high_first, low_first };
/// How a voltage is written into registers.
enum class VoltageEncoding : std::uint8_t { int16, int32, float32 };

/// A counter: one register (16 bits) or two (32 bits).
struct CounterFormat {
  int registers = 2;                             ///< 1 or 2, of 16 bits
  WordOrder word_order = WordOrder::high_first;  ///< of two registers
};

/// The voltage: int16 (one register), int32 or float32 (two). Integers hold volts times `counts_per_v`.
struct VoltageFormat {
  VoltageEncoding encoding = VoltageEncoding::int16;  ///< what the registers hold
  WordOrder word_order = WordOrder::high_first;       ///< of two registers
  double counts_per_v = 1.0;                          ///< of a whole number [1/V]

  /// How many registers it takes.
  int registers() const noexcept { return encoding == VoltageEncoding::int16 ? 1 : 2; }
  /// The largest voltage that the format can represent.
  double largest_v() const noexcept;
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

/// What counts an encoder.
enum class ComediEncoderKind : std::uint8_t {
  counter,        ///< a quadrature counter, configured as its driver requires
  plain_counter,  ///< a counter that is configured elsewhere and only read
  analog_input,   ///< a potentiometer
};

/// Reference potential of an analog input.
enum class ComediReference : std::uint8_t { ground, common, difference, other };

/// Limits of a voltage range that a channel offers.
struct ComediRange {
  double low_v = 0.0;   ///< lower end [V]
  double high_v = 0.0;  ///< upper end [V]
};

/// Input lines (PFI) for A and B of an encoder, where the driver can route them to a counter.
struct ComediLines {
  int a = 0;  ///< of signal A
  int b = 0;  ///< of signal B
};

/// How an encoder is wired.
struct ComediEncoder {
  std::string device;                                   ///< "/dev/comedi0"
  int subdevice = 0;                                    ///< of the card
  int channel = 0;                                      ///< of the subdevice
  ComediEncoderKind kind = ComediEncoderKind::counter;  ///< what counts
  std::optional<ComediLines> lines;                     ///< counter: as its driver requires
  // Analog input only.
  ComediRange range;                                    ///< of an analog input
  ComediReference reference = ComediReference::ground;  ///< of an analog input
  double counts_per_v = 0.0;                            ///< of an analog input [1/V]
};

/// How the amplifier is wired.
struct ComediOutput {
  std::string device;           ///< file of the card: /dev/comedi0
  int subdevice = 0;            ///< of the card
  int channel = 0;              ///< of the subdevice
  ComediRange range;            ///< of the output
  double amplifier_gain = 1.0;  ///< volts at the motor per volt at the channel
};

/// The parts of a rig that are connected to Comedi devices.
struct ComediRig {
  std::optional<ComediEncoder> cart;      ///< absent: another backend counts
  std::optional<ComediEncoder> pendulum;  ///< absent: another backend counts
  std::optional<ComediOutput> output;     ///< absent: another backend has the output
};

/// Bias resistors of the chip on an input, where it has them.
enum class LineBias : std::uint8_t { as_is, pull_up, pull_down };

/// One line, identified by its offset on the chip.
struct DigitalLine {
  int line = 0;                     ///< number on the chip
  bool active_high = true;          ///< the level that means pressed, or enabled
  LineBias bias = LineBias::as_is;  ///< the chip's own resistor
};

/// The ends of the track.
enum class TrackEnd : std::uint8_t { plus_x, minus_x };

/// A switch at an end of the track.
struct LimitSwitch {
  TrackEnd end = TrackEnd::plus_x;  ///< at which end
  DigitalLine line;                 ///< how it is wired
};

/// An incremental encoder whose edges the kernel reports. Each edge of either line is one count.
struct LineEncoder {
  int a = 0;                         ///< counts increase where A leads B
  int b = 0;                         ///< number of signal B on the chip
  LineBias bias = LineBias::as_is;   ///< the chip's own resistors
  double fastest_edges_per_s = 0.0;  ///< a higher rate is a fault, because edges might be lost
};

/// Section `gpio` of a rig file.
struct GpioRig {
  std::string chip;                             ///< name (gpiochip0), label, or path (/dev/gpiochip0)
  std::optional<DigitalLine> emergency_stop;    ///< stops the motor while it is active
  std::vector<LimitSwitch> limit_switches;      ///< stop the motor while they are active
  std::optional<DigitalLine> amplifier_enable;  ///< active while the motor may move
  std::optional<int> heartbeat;             ///< a line toggled with every voltage, for an external watchdog
  std::optional<LineEncoder> cart_encoder;  ///< absent: another backend counts
  std::optional<LineEncoder> pendulum_encoder;  ///< absent: another backend counts
};

/// The analog output of the card and its range.
struct QuanserOutput {
  int channel = 0;              ///< number on the card
  double low_v = -10.0;         ///< lower end of its range
  double high_v = 10.0;         ///< upper end of its range
  bool sets_range = false;      ///< the output range is programmable: set it to this range
  double amplifier_gain = 1.0;  ///< volts at the motor per volt at the channel
};

/// The digital output that enables the amplifier.
struct QuanserEnable {
  int line = 0;             ///< number on the card
  bool active_high = true;  ///< the level that enables the amplifier
};

/// The parts of a rig that are connected to a Quanser card.
struct QuanserRig {
  std::string library = "libhil.so";  ///< name that the dynamic loader resolves, or a path
  std::string folder;                 ///< folder of the libraries; empty: the loader's search path
  // Dependencies of `library`, loaded before it. A missing one is left to the loader.
  std::string common_library = "libquanser_common.so";    ///< as the loader finds it
  std::string runtime_library = "libquanser_runtime.so";  ///< as the loader finds it
  std::string board_type;                                 ///< card type for hil_open, for example "q2_usb"
  std::string board_identifier = "0";                     ///< or a URI
  std::string board_options;                              ///< for hil_set_card_specific_options; empty: none
  bool is_clock = false;                ///< the card samples on its own time, and the loop follows it
  bool reads_velocities = false;        ///< of the encoders, which the card measures
  std::optional<int> cart_channel;      ///< absent: another backend counts
  std::optional<int> pendulum_channel;  ///< absent: another backend counts
  std::optional<QuanserOutput> output;  ///< absent: another backend has the output
  std::optional<QuanserEnable> amplifier_enable;  ///< absent: the card does not enable it
  double watchdog_s = 0.0;                        ///< time of the card's watchdog; 0: none
};

}  // namespace upright
