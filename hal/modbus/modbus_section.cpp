// Section `modbus` of a rig file, read and written.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "../backends.hpp"
#include "../quoted.hpp"
#include "../yaml_words.hpp"
#include "modbus_rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

namespace {

constexpr int last_address = 65535;
constexpr int most_registers_per_read = 125;

constexpr Words<3> parities = {"none", "even", "odd"};
constexpr Words<2> exchanges = {"read_write", "separate"};
constexpr Words<2> word_orders = {"high_first", "low_first"};
constexpr Words<3> encodings = {"int16", "int32", "float32"};
constexpr Words<2> tables = {"holding", "input"};

DeviceWatchdog read_watchdog(const YamlMap& map) {
  DeviceWatchdog watchdog;
  watchdog.address = small_integer(map, "address", 0, last_address);
  watchdog.time_s = map.number("time_s", Range{0, RigFile::longest_watchdog_s, true});
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

bool is_serial(const ModbusRig& rig) {
  return !rig.device.empty();
}

template <Backend backend>
void read_link(const YamlMap& document, RigFile& rig) {
  if (roles_of(rig, Backend::modbus_tcp).any() && roles_of(rig, Backend::modbus_rtu).any())
    document.fail("backend", "names both Modbus links", "use one of modbus-tcp and modbus-rtu");
  rig.modbus = read_modbus(document.map("modbus"), backend == Backend::modbus_rtu, rig);
}

template <Backend backend>
std::string text_of_link(const RigFile& rig) {
  if (!rig.modbus || is_serial(*rig.modbus) != (backend == Backend::modbus_rtu)) return "";
  return modbus_text(*rig.modbus, roles_of(rig, backend));
}

std::unique_ptr<Rig> make_modbus(const RigFile& rig, double period_s) {
  return std::make_unique<ModbusTransport>(rig, period_s);
}

}  // namespace

int DeviceWatchdog::counts() const {
  return std::max(1, static_cast<int>(std::nearbyint(time_s / seconds_per_count)));
}

bool baud_is_known(int baud) {
  static constexpr std::array known = {
      110,    300,    600,    1200,   2400,    4800,    9600,    19200,   38400,   57600,   115200,  230400,
      460800, 500000, 576000, 921600, 1000000, 1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000};
  return std::find(known.begin(), known.end(), baud) != known.end();
}

BackendKind modbus_tcp_backend() {
  constexpr Backend link = Backend::modbus_tcp;
  return {"modbus-tcp", read_link<link>, text_of_link<link>, make_modbus};
}

BackendKind modbus_rtu_backend() {
  constexpr Backend link = Backend::modbus_rtu;
  return {"modbus-rtu", read_link<link>, text_of_link<link>, make_modbus};
}

}  // namespace upright
