#include "upright/hal/rig_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "comedi/comedi_section.hpp"
#include "gpio/gpio_section.hpp"
#include "quanser/quanser_section.hpp"
#include "quoted.hpp"
#include "upright/base/error.hpp"
#include "yaml_words.hpp"

namespace upright {

namespace {

constexpr int last_address = 65535;
constexpr int most_registers_per_read = 125;
constexpr int finer_without_quantisation = 1024;
constexpr double longest_watchdog_s = 10.0;
constexpr double longest_spin_us = 1e4;  // the loop also keeps it below half a period

constexpr Words<6> backends = {"simulated", "modbus-tcp", "modbus-rtu", "gpio", "comedi", "quanser-hil"};
constexpr Words<3> parities = {"none", "even", "odd"};
constexpr Words<2> exchanges = {"read_write", "separate"};
constexpr Words<2> word_orders = {"high_first", "low_first"};
constexpr Words<3> encodings = {"int16", "int32", "float32"};
constexpr Words<2> poses = {"upright", "hanging"};
constexpr Words<2> tables = {"holding", "input"};
constexpr Words<2> zeros = {"counts", "start"};

int small_integer(const YamlMap& map, const std::string& key, int low, int high) {
  return static_cast<int>(map.integer(key, low, high));
}

int read_sign(const YamlMap& map) {
  const int sign = small_integer(map, "sign", -1, 1);
  if (sign == 0) map.fail("sign", "is 0", "give sign 1 or -1");
  return sign;
}

EncoderCalibration read_encoder(const YamlMap& map, bool is_cart) {
  EncoderCalibration encoder;
  encoder.per_count = is_cart ? map.number("m_per_count", Range{1e-9, 1e-2})
                              : 2.0 * std::numbers::pi / map.number("counts_per_revolution", Range{16, 1e8});
  encoder.sign = read_sign(map);
  encoder.width_bits = small_integer(map, "width_bits", 8, 32);
  encoder.fastest_per_s = map.number(is_cart ? "fastest_mps" : "fastest_radps", Range{1e-3, 1e4});
  map.finish();
  return encoder;
}

Calibration read_calibration(const YamlMap& map) {
  Calibration calibration;
  calibration.cart = read_encoder(map.map("cart"), true);
  calibration.pendulum = read_encoder(map.map("pendulum"), false);
  const YamlMap zero = map.map("zero");
  calibration.zero_at_start = choose<int>(zero, "at", zeros) == 1;
  if (!calibration.zero_at_start) {
    const auto counts = [&](const char* key, int width_bits) {
      return zero.integer(key, -(std::int64_t{1} << (width_bits - 1)), (std::int64_t{1} << width_bits) - 1);
    };
    calibration.cart_zero_counts = counts("cart_counts", calibration.cart.width_bits);
    calibration.pendulum_zero_counts = counts("pendulum_counts", calibration.pendulum.width_bits);
  }
  calibration.zero_pose = choose<ZeroPose>(zero, "pose", poses);
  zero.finish();
  map.finish();
  return calibration;
}

SimulatedRig read_simulated(const YamlMap& map) {
  SimulatedRig rig;
  rig.plant = map.path("plant");
  const YamlMap initial = map.map("initial");
  rig.initial.cart_m = initial.number("cart_m", Range::within(-10, 10));
  rig.initial.theta_rad = initial.number("theta_rad", Range::within(-100, 100));
  rig.initial_cart_mps = initial.number_or("cart_velocity_mps", 0.0, Range::within(-100, 100));
  rig.initial_theta_radps = initial.number_or("pendulum_rate_radps", 0.0, Range::within(-1000, 1000));
  initial.finish();
  rig.quantise = map.flag_or("quantise", true);
  if (const auto noise = map.optional_map("noise")) {
    rig.cart_noise_m = noise->number_or("cart_m", 0.0, Range::within(0, 0.1));
    rig.theta_noise_rad = noise->number_or("theta_rad", 0.0, Range::within(0, 0.5));
    noise->finish();
  }
  rig.timing_jitter_s = map.number_or("timing_jitter_s", 0.0, Range::within(0, 0.01));
  map.finish();
  return rig;
}

DeviceWatchdog read_watchdog(const YamlMap& map) {
  DeviceWatchdog watchdog;
  watchdog.address = small_integer(map, "address", 0, last_address);
  watchdog.time_s = map.number("time_s", Range{0, longest_watchdog_s, true});
  watchdog.seconds_per_count = map.number("seconds_per_count", Range{1e-6, 10});
  const double counts = watchdog.time_s / watchdog.seconds_per_count;
  if (counts < 0.5 || counts > 65535.0)
    map.fail("time_s", "does not fit into a 16-bit register",
             "give time_s 1 to 65535 times seconds_per_count");
  map.finish();
  return watchdog;
}

void read_serial_line(const YamlMap& map, ModbusRig& rig) {
  rig.device = map.text("device");
  rig.baud = small_integer(map, "baud", 1, 10'000'000);
  if (!baud_is_known(rig.baud))
    map.fail("baud", "is " + std::to_string(rig.baud),
             "use a standard rate such as 9600, 19200, 38400, 57600, 115200, 230400, 460800 or 921600");
  rig.parity = choose<Parity>(map, "parity", parities);
  rig.stop_bits = small_integer(map, "stop_bits", 1, 2);
}

void read_counters(const YamlMap& map, const Calibration& calibration, const RigRoles& roles,
                   ModbusRig& rig) {
  rig.input_registers = choose<int>(map, "table", tables) == 1;
  if (roles.cart) rig.cart_address = small_integer(map, "cart_address", 0, last_address);
  if (roles.pendulum) rig.pendulum_address = small_integer(map, "pendulum_address", 0, last_address);
  rig.counter.registers = small_integer(map, "registers", 1, 2);
  rig.counter.word_order = rig.counter.registers == 2 || map.has("word_order")
                               ? choose<WordOrder>(map, "word_order", word_orders)
                               : WordOrder::high_first;
  const int widest = std::max(roles.cart ? calibration.cart.width_bits : 0,
                              roles.pendulum ? calibration.pendulum.width_bits : 0);
  if (widest > 16 * rig.counter.registers)
    map.fail("registers", "is 1, for counters of " + std::to_string(widest) + " bits",
             "give registers 2, or width_bits 16 in the calibration");
  map.finish();
}

void read_voltage(const YamlMap& map, double limit_v, ModbusRig& rig) {
  rig.voltage_address = small_integer(map, "address", 0, last_address);
  rig.voltage.encoding = choose<VoltageEncoding>(map, "encoding", encodings);
  rig.voltage.word_order = rig.voltage.registers() == 2 || map.has("word_order")
                               ? choose<WordOrder>(map, "word_order", word_orders)
                               : WordOrder::high_first;
  rig.voltage.counts_per_v = map.number("counts_per_v", Range{1e-3, 1e9});
  if (rig.voltage.largest_v() < limit_v)
    map.fail("counts_per_v", "leaves no room for the amplifier's limit",
             "give counts_per_v at most " +
                 exact_text(rig.voltage.largest_v() * rig.voltage.counts_per_v / limit_v));
  rig.voltage_reads_back = map.flag_or("read_back", true);
  map.finish();
}

/// Registers one after the other that belong together.
struct Block {
  const char* key;
  int first;
  int count;
};

void refuse_overlap(const YamlMap& map, const std::vector<Block>& blocks) {
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Block& a = blocks[i];
    if (a.first + a.count - 1 > last_address)
      map.fail(a.key, "ends beyond register 65535", "give it a lower address");
    for (std::size_t j = 0; j < i; ++j) {
      const Block& b = blocks[j];
      if (a.first < b.first + b.count && b.first < a.first + a.count)
        map.fail(a.key, std::string("shares a register with ") + b.key, "give each its own registers");
    }
  }
}

/// With function 0x17 every request carries a voltage, which is zero where another backend has the output.
bool carries_voltage(const ModbusRig& rig, const RigRoles& roles) {
  return roles.output || rig.exchange == ModbusExchange::read_write;
}

void check_registers(const YamlMap& map, const ModbusRig& rig, const RigRoles& roles) {
  std::vector<Block> read;
  if (roles.cart) read.push_back({"counters", rig.cart_address, rig.counter.registers});
  if (roles.pendulum) read.push_back({"counters", rig.pendulum_address, rig.counter.registers});
  if (rig.boot_count_address) read.push_back({"boot_count_address", *rig.boot_count_address, 1});
  if (rig.status_address) read.push_back({"status_address", *rig.status_address, 1});
  std::vector<Block> written;
  if (carries_voltage(rig, roles))
    written.push_back({"voltage", rig.voltage_address, rig.voltage.registers()});
  if (rig.enable_address) written.push_back({"enable_address", *rig.enable_address, 1});
  if (rig.watchdog) written.push_back({"device_watchdog", rig.watchdog->address, 1});
  refuse_overlap(map, read);
  if (rig.input_registers) {
    refuse_overlap(map, written);
  } else {
    std::vector<Block> all = read;
    all.insert(all.end(), written.begin(), written.end());
    refuse_overlap(map, all);
  }
  int first = last_address, end = 0;
  for (const Block& block : read) {
    first = std::min(first, block.first);
    end = std::max(end, block.first + block.count);
  }
  if (end - first > most_registers_per_read)
    map.fail("counters", "span " + std::to_string(end - first) + " registers, boot count and status included",
             "put them within 125 registers, one request reads them all");
  if (rig.exchange == ModbusExchange::read_write && rig.input_registers)
    map.fail("exchange", "is read_write, which reads holding registers only",
             "use separate, or table holding");
}

ModbusRig read_modbus(const YamlMap& map, bool serial, const RigFile& rig_file) {
  ModbusRig rig;
  if (serial) {
    read_serial_line(map, rig);
  } else {
    rig.host = map.text("host");
    rig.port = small_integer(map, "port", 1, 65535);
  }
  rig.unit = small_integer(map, "unit", serial ? 1 : 0, serial ? 247 : 255);
  rig.response_timeout_s = map.number("response_timeout_s", Range{1e-4, 1.0});
  rig.exchange = choose<ModbusExchange>(map, "exchange", exchanges);
  const RigRoles roles = roles_of(rig_file, serial ? Backend::modbus_rtu : Backend::modbus_tcp);
  if (roles.encoders()) read_counters(map.map("counters"), rig_file.calibration, roles, rig);
  if (map.has("boot_count_address"))
    rig.boot_count_address = small_integer(map, "boot_count_address", 0, last_address);
  if (map.has("status_address")) rig.status_address = small_integer(map, "status_address", 0, last_address);
  if (carries_voltage(rig, roles)) read_voltage(map.map("voltage"), rig_file.amplifier.limit_v, rig);
  if (roles.output) {
    if (map.has("enable_address")) rig.enable_address = small_integer(map, "enable_address", 0, last_address);
    if (const auto watchdog = map.optional_map("device_watchdog")) rig.watchdog = read_watchdog(*watchdog);
  }
  check_registers(map, rig, roles);
  if (rig.response_timeout_s >= rig_file.watchdog_s)
    map.fail("response_timeout_s", "is not below watchdog_s", "give it less than the watchdog's time");
  map.finish();
  return rig;
}

void read_backends(const YamlMap& document, RigFile& rig) {
  if (!document.is_map("backend")) {
    rig.cart_encoder = rig.pendulum_encoder = rig.output = choose<Backend>(document, "backend", backends);
    return;
  }
  const YamlMap map = document.map("backend");
  if (map.has("cart_encoder") || map.has("pendulum_encoder")) {
    rig.cart_encoder = choose<Backend>(map, "cart_encoder", backends);
    rig.pendulum_encoder = choose<Backend>(map, "pendulum_encoder", backends);
  } else {
    rig.cart_encoder = rig.pendulum_encoder = choose<Backend>(map, "encoders", backends);
  }
  rig.output = choose<Backend>(map, "output", backends);
  map.finish();
  const RigRoles simulated = roles_of(rig, Backend::simulated);
  if (simulated.any() && !simulated.all())
    document.fail("backend",
                  "joins simulated to hardware, but a simulated plant moves by its own output only",
                  "use simulated for all of it or for none");
}

bool uses(const RigFile& rig, Backend backend) {
  return roles_of(rig, backend).any();
}

/// The section `gpio` has the encoders that the rig takes from it, and no others.
void check_gpio_roles(const YamlMap& document, const RigFile& rig) {
  const RigRoles roles = roles_of(rig, Backend::gpio);
  if (roles.output)
    document.fail("backend", "gives the output to gpio, whose lines cannot carry a voltage",
                  "name another backend as output");
  if (!rig.gpio) return;
  const YamlMap section = document.map("gpio");
  const auto match = [&](const char* key, bool is_wanted, bool is_there) {
    if (is_wanted && !is_there)
      section.fail(key, "is missing, though backend takes its counts from gpio",
                   std::string("add ") + key + " (its lines a and b)");
    if (!is_wanted && is_there)
      section.fail(key, "is not in use, since backend takes its counts from elsewhere",
                   std::string("remove ") + key + ", or name gpio as its backend");
  };
  match("cart_encoder", roles.cart, rig.gpio->cart_encoder.has_value());
  match("pendulum_encoder", roles.pendulum, rig.gpio->pendulum_encoder.has_value());
}

std::string backend_line(const RigFile& rig) {
  const std::string cart = backend_name(rig.cart_encoder), pendulum = backend_name(rig.pendulum_encoder);
  const std::string output = backend_name(rig.output);
  if (cart != pendulum)
    return "backend: {cart_encoder: " + cart + ", pendulum_encoder: " + pendulum + ", output: " + output +
           "}\n";
  if (cart != output) return "backend: {encoders: " + cart + ", output: " + output + "}\n";
  return "backend: " + output + "\n";
}

std::string zero_text(const Calibration& calibration) {
  std::string text = "{at: ";
  if (calibration.zero_at_start)
    text += "start";
  else
    text += "counts, cart_counts: " + std::to_string(calibration.cart_zero_counts) +
            ", pendulum_counts: " + std::to_string(calibration.pendulum_zero_counts);
  return text + ", pose: " + word_of(calibration.zero_pose, poses) + "}";
}

/// Counts per revolution whose reader gives the same radians per count, bit for bit.
std::string counts_per_revolution_text(double rad_per_count) {
  const double turn = 2.0 * std::numbers::pi;
  const double near = turn / rad_per_count;
  if (turn / std::nearbyint(near) == rad_per_count) return exact_text(std::nearbyint(near));
  double low = near, high = near;
  for (int i = 0; i < 16; ++i) {
    if (turn / low == rad_per_count) return exact_text(low);
    if (turn / high == rad_per_count) return exact_text(high);
    low = std::nextafter(low, 0.0);
    high = std::nextafter(high, 2.0 * high);
  }
  return exact_text(near);
}

std::string calibration_text(const Calibration& calibration) {
  const EncoderCalibration& cart = calibration.cart;
  const EncoderCalibration& pendulum = calibration.pendulum;
  return "calibration:\n  cart: {m_per_count: " + exact_text(cart.per_count) +
         ", sign: " + std::to_string(cart.sign) + ", width_bits: " + std::to_string(cart.width_bits) +
         ", fastest_mps: " + exact_text(cart.fastest_per_s) +
         "}\n  pendulum: {counts_per_revolution: " + counts_per_revolution_text(pendulum.per_count) +
         ", sign: " + std::to_string(pendulum.sign) + ", width_bits: " + std::to_string(pendulum.width_bits) +
         ", fastest_radps: " + exact_text(pendulum.fastest_per_s) + "}\n  zero: " + zero_text(calibration) +
         "\n";
}

std::string simulated_text(const SimulatedRig& rig) {
  return "simulated:\n  plant: " + quoted(rig.plant.string()) +
         "\n  initial: {cart_m: " + exact_text(rig.initial.cart_m) +
         ", theta_rad: " + exact_text(rig.initial.theta_rad) +
         ", cart_velocity_mps: " + exact_text(rig.initial_cart_mps) +
         ", pendulum_rate_radps: " + exact_text(rig.initial_theta_radps) +
         "}\n  quantise: " + (rig.quantise ? "true" : "false") +
         "\n  noise: {cart_m: " + exact_text(rig.cart_noise_m) +
         ", theta_rad: " + exact_text(rig.theta_noise_rad) +
         "}\n  timing_jitter_s: " + exact_text(rig.timing_jitter_s) + "\n";
}

std::string link_text(const ModbusRig& rig) {
  if (rig.device.empty())
    return "  host: " + quoted(rig.host) + "\n  port: " + std::to_string(rig.port) + "\n";
  return "  device: " + quoted(rig.device) + "\n  baud: " + std::to_string(rig.baud) +
         "\n  parity: " + word_of(rig.parity, parities) + "\n  stop_bits: " + std::to_string(rig.stop_bits) +
         "\n";
}

std::string counters_text(const ModbusRig& rig, const RigRoles& roles) {
  std::string text = "  counters: {table: " + word_of(rig.input_registers ? 1 : 0, tables);
  if (roles.cart) text += ", cart_address: " + std::to_string(rig.cart_address);
  if (roles.pendulum) text += ", pendulum_address: " + std::to_string(rig.pendulum_address);
  return text + ", registers: " + std::to_string(rig.counter.registers) +
         ", word_order: " + word_of(rig.counter.word_order, word_orders) + "}\n";
}

std::string modbus_text(const ModbusRig& rig, const RigRoles& roles) {
  std::string text = "modbus:\n" + link_text(rig) + "  unit: " + std::to_string(rig.unit) +
                     "\n  response_timeout_s: " + exact_text(rig.response_timeout_s) +
                     "\n  exchange: " + word_of(rig.exchange, exchanges) + "\n";
  if (roles.encoders()) text += counters_text(rig, roles);
  if (rig.boot_count_address)
    text += "  boot_count_address: " + std::to_string(*rig.boot_count_address) + "\n";
  if (rig.status_address) text += "  status_address: " + std::to_string(*rig.status_address) + "\n";
  if (carries_voltage(rig, roles))
    text += "  voltage: {address: " + std::to_string(rig.voltage_address) +
            ", encoding: " + word_of(rig.voltage.encoding, encodings) +
            ", word_order: " + word_of(rig.voltage.word_order, word_orders) +
            ", counts_per_v: " + exact_text(rig.voltage.counts_per_v) +
            (rig.voltage_reads_back ? "" : ", read_back: false") + "}\n";
  if (rig.enable_address) text += "  enable_address: " + std::to_string(*rig.enable_address) + "\n";
  if (rig.watchdog)
    text += "  device_watchdog: {address: " + std::to_string(rig.watchdog->address) +
            ", time_s: " + exact_text(rig.watchdog->time_s) +
            ", seconds_per_count: " + exact_text(rig.watchdog->seconds_per_count) + "}\n";
  return text;
}

}  // namespace

std::string backend_name(Backend backend) {
  return word_of(backend, backends);
}

RigRoles roles_of(const RigFile& rig, Backend backend) {
  return {rig.cart_encoder == backend, rig.pendulum_encoder == backend, rig.output == backend};
}

bool is_simulated(const RigFile& rig) {
  return roles_of(rig, Backend::simulated).any();
}

std::string backends_text(const RigFile& rig) {
  const std::string cart = backend_name(rig.cart_encoder), pendulum = backend_name(rig.pendulum_encoder);
  const std::string output = backend_name(rig.output);
  if (cart != pendulum)
    return "cart's encoder " + cart + ", pendulum's encoder " + pendulum + ", output " + output;
  return cart == output ? output : "encoders " + cart + ", output " + output;
}

int DeviceWatchdog::counts() const {
  return std::max(1, static_cast<int>(std::nearbyint(time_s / seconds_per_count)));
}

bool baud_is_known(int baud) {
  static constexpr std::array known = {
      110,    300,    600,    1200,   2400,    4800,    9600,    19200,   38400,   57600,   115200,  230400,
      460800, 500000, 576000, 921600, 1000000, 1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000};
  return std::find(known.begin(), known.end(), baud) != known.end();
}

Calibration calibration_in_use(const RigFile& rig) {
  Calibration calibration = rig.calibration;
  if (!is_simulated(rig) || !rig.simulated || rig.simulated->quantise) return calibration;
  for (EncoderCalibration* encoder : {&calibration.cart, &calibration.pendulum}) {
    encoder->per_count /= finer_without_quantisation;
    encoder->width_bits = 32;
  }
  calibration.cart_zero_counts *= finer_without_quantisation;
  calibration.pendulum_zero_counts *= finer_without_quantisation;
  return calibration;
}

RigFile read_rig(const YamlMap& document) {
  RigFile rig;
  rig.file = document.file();
  read_backends(document, rig);
  rig.calibration = read_calibration(document.map("calibration"));
  const YamlMap amplifier = document.map("amplifier");
  rig.amplifier.limit_v = amplifier.number("limit_v", Range{0, 100, true});
  rig.amplifier.sign = read_sign(amplifier);
  amplifier.finish();
  const YamlMap track = document.map("track");
  rig.track_limit_m = track.number("limit_m", Range{0, 100, true});
  rig.coast_s = track.number_or("coast_s", 0.0, Range::within(0, 10));
  track.finish();
  rig.fall_angle_rad = document.number("fall_angle_rad", Range{0, std::numbers::pi, true});
  rig.watchdog_s = document.number("watchdog_s", Range{0, longest_watchdog_s, true});
  rig.spin_us = document.number_or("spin_us", 0.0, Range::within(0, longest_spin_us));
  const bool serial = uses(rig, Backend::modbus_rtu);
  if (serial && uses(rig, Backend::modbus_tcp))
    document.fail("backend", "names both Modbus links", "use one of modbus-tcp and modbus-rtu");
  if (uses(rig, Backend::simulated) || document.has("simulated"))
    rig.simulated = read_simulated(document.map("simulated"));
  if (serial || uses(rig, Backend::modbus_tcp)) rig.modbus = read_modbus(document.map("modbus"), serial, rig);
  if (uses(rig, Backend::comedi)) rig.comedi = read_comedi(document.map("comedi"), rig);
  if (uses(rig, Backend::quanser_hil)) rig.quanser = read_quanser(document.map("quanser_hil"), rig);
  if (uses(rig, Backend::gpio) || document.has("gpio")) rig.gpio = read_gpio(document.map("gpio"));
  if (const auto watch = document.optional_map("encoder_watch"))
    rig.encoder_watch = read_encoder_assumptions(*watch);
  check_gpio_roles(document, rig);
  document.finish();
  return rig;
}

RigFile read_rig_file(const std::filesystem::path& file) {
  return read_rig(YamlMap::from_file(file));
}

std::string rig_text(const RigFile& rig) {
  std::string text = backend_line(rig);
  text += calibration_text(rig.calibration);
  text += "amplifier: {limit_v: " + exact_text(rig.amplifier.limit_v) +
          ", sign: " + std::to_string(rig.amplifier.sign) +
          "}\ntrack: {limit_m: " + exact_text(rig.track_limit_m) + ", coast_s: " + exact_text(rig.coast_s) +
          "}\nfall_angle_rad: " + exact_text(rig.fall_angle_rad) +
          "\nwatchdog_s: " + exact_text(rig.watchdog_s) + "\n";
  if (rig.spin_us > 0.0) text += "spin_us: " + exact_text(rig.spin_us) + "\n";
  if (rig.simulated) text += simulated_text(*rig.simulated);
  if (rig.modbus)
    text += modbus_text(
        *rig.modbus, roles_of(rig, rig.modbus->device.empty() ? Backend::modbus_tcp : Backend::modbus_rtu));
  if (rig.comedi) text += comedi_text(*rig.comedi);
  if (rig.quanser) text += quanser_text(*rig.quanser);
  if (rig.gpio) text += gpio_text(*rig.gpio);
  if (rig.encoder_watch) text += "encoder_watch: " + encoder_assumptions_text(*rig.encoder_watch) + "\n";
  return text;
}

}  // namespace upright
