// The keys of section `modbus` of a rig file.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "../backends.hpp"
#include "base/yaml_keys.hpp"
#include "modbus_rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

namespace {

constexpr int last_address = 65535;
constexpr int max_registers_per_read = 125;

constexpr Words<3> parities = {"none", "even", "odd"};
constexpr Words<2> exchanges = {"read_write", "separate"};
constexpr Words<2> word_orders = {"high_first", "low_first"};
constexpr Words<3> encodings = {"int16", "int32", "float32"};
constexpr Words<2> tables = {"holding", "input"};

void address_key(YamlKeys& keys, const char* key, int& address) {
  keys.integer(key, address, 0, last_address);
}

void optional_address_key(YamlKeys& keys, const char* key, std::optional<int>& address) {
  keys.optional_integer(key, address, 0, last_address);
}

void watchdog_keys(YamlKeys& keys, DeviceWatchdog& watchdog) {
  address_key(keys, "address", watchdog.address);
  keys.number("time_s", watchdog.time_s, Range{0, RigFile::longest_watchdog_s, true});
  keys.number("seconds_per_count", watchdog.seconds_per_count, Range{1e-6, 10});
  const double counts = watchdog.time_s / watchdog.seconds_per_count;
  keys.check("time_s", counts >= 0.5 && counts <= 65535.0, "does not fit into a 16-bit register",
             "set time_s to 1 to 65535 times seconds_per_count");
}

void sampling_keys(YamlKeys& keys, DeviceSampling& sampling) {
  address_key(keys, "sample_address", sampling.sample_address);
  address_key(keys, "period_address", sampling.period_address);
  keys.number("seconds_per_count", sampling.seconds_per_count, Range{1e-9, 1});
}

void serial_line_keys(YamlKeys& keys, ModbusRig& rig) {
  keys.text("device", rig.device);
  keys.integer("baud", rig.baud, 110, 4'000'000);
  keys.check("baud", baud_is_known(rig.baud), "is " + std::to_string(rig.baud) + ", which is not supported",
             "use a standard rate such as 9600, 19200, 38400, 57600, 115200, 230400, 460800 or 921600");
  keys.one_of("parity", rig.parity, parities);
  keys.integer("stop_bits", rig.stop_bits, 1, 2);
}

void word_order_key(YamlKeys& keys, WordOrder& order, int registers) {
  keys.one_of("word_order", order, word_orders,
              registers == 2 ? required : std::optional(WordOrder::high_first));
}

void counter_keys(YamlKeys& keys, const Calibration& calibration, const RigRoles& roles, ModbusRig& rig) {
  keys.one_of("table", rig.input_registers, tables);
  if (roles.cart) address_key(keys, "cart_address", rig.cart_address);
  if (roles.pendulum) address_key(keys, "pendulum_address", rig.pendulum_address);
  keys.integer("registers", rig.counter.registers, 1, 2);
  word_order_key(keys, rig.counter.word_order, rig.counter.registers);
  const int widest = std::max(roles.cart ? calibration.cart.width_bits : 0,
                              roles.pendulum ? calibration.pendulum.width_bits : 0);
  keys.check("registers", widest <= 16 * rig.counter.registers,
             "is 1, for counters of " + std::to_string(widest) + " bits",
             "set registers to 2, or width_bits to 16 in the calibration");
}

void voltage_keys(YamlKeys& keys, double limit_v, ModbusRig& rig) {
  address_key(keys, "address", rig.voltage_address);
  keys.one_of("encoding", rig.voltage.encoding, encodings);
  word_order_key(keys, rig.voltage.word_order, rig.voltage.registers());
  keys.number("counts_per_v", rig.voltage.counts_per_v, Range{1e-3, 1e9});
  const double largest_v = rig.voltage.largest_v();
  keys.check("counts_per_v", largest_v >= limit_v, "is too large for the encoding to hold amplifier.limit_v",
             "reduce counts_per_v to at most " + exact_text(largest_v * rig.voltage.counts_per_v / limit_v));
  keys.flag("read_back", rig.voltage_reads_back, true, Usual::left_out);
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
      map.fail(a.key, "ends beyond register 65535", "use a lower address");
    for (std::size_t j = 0; j < i; ++j) {
      const Block& b = blocks[j];
      if (a.first < b.first + b.count && b.first < a.first + a.count)
        map.fail(a.key, std::string("shares a register with ") + b.key, "use different registers for each");
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
  if (rig.sampling) read.push_back({"device_clock", rig.sampling->sample_address, 1});
  std::vector<Block> written;
  if (carries_voltage(rig, roles))
    written.push_back({"voltage", rig.voltage_address, rig.voltage.registers()});
  if (rig.enable_address) written.push_back({"enable_address", *rig.enable_address, 1});
  if (rig.watchdog) written.push_back({"device_watchdog", rig.watchdog->address, 1});
  if (rig.sampling) written.push_back({"device_clock", rig.sampling->period_address, 1});
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
    if (rig.sampling && block.first > rig.sampling->sample_address)
      map.fail("device_clock", "has a sample_address before the other registers that are read",
               "use a device whose sample_address follows them, or remove device_clock");
    first = std::min(first, block.first);
    end = std::max(end, block.first + block.count);
  }
  if (end - first > max_registers_per_read)
    map.fail("counters",
             "span " + std::to_string(end - first) + " registers, including boot count and status",
             "place them within 125 registers, because one request reads them all");
}

void link_keys(YamlKeys& keys, bool is_serial, ModbusRig& rig) {
  if (is_serial) {
    serial_line_keys(keys, rig);
  } else {
    keys.text("host", rig.host);
    keys.integer("port", rig.port, 1, 65535);
  }
  keys.integer("unit", rig.unit, is_serial ? 1 : 0, is_serial ? 247 : 255);
  keys.number("response_timeout_s", rig.response_timeout_s, Range{1e-4, 1.0});
  keys.one_of("exchange", rig.exchange, exchanges);
}

void modbus_keys(YamlKeys& keys, Backend link, const RigFile& rig_file, ModbusRig& rig) {
  link_keys(keys, link == Backend::modbus_rtu, rig);
  const RigRoles roles = roles_of(rig_file, link);
  if (roles.encoders())
    keys.deciding_map("counters",
                      [&](YamlKeys& map) { counter_keys(map, rig_file.calibration, roles, rig); });
  optional_address_key(keys, "boot_count_address", rig.boot_count_address);
  optional_address_key(keys, "status_address", rig.status_address);
  if (carries_voltage(rig, roles))
    keys.map("voltage", [&](YamlKeys& map) { voltage_keys(map, rig_file.amplifier.limit_v, rig); });
  if (roles.output) {
    optional_address_key(keys, "enable_address", rig.enable_address);
    keys.optional_map("device_watchdog", rig.watchdog, watchdog_keys);
  }
  if (roles.output && roles.encoders() &&
      keys.decides_by_presence("device_clock", rig.sampling.has_value())) {
    keys.map("device_clock", [&](YamlKeys& map) { sampling_keys(map, YamlKeys::made(rig.sampling)); });
    keys.needs("device_clock", rig.exchange == ModbusExchange::read_write,
               "needs one exchange that carries counts and voltage", "use exchange: read_write");
  }
  if (const YamlMap* map = keys.source()) check_registers(*map, rig, roles);
  keys.needs("exchange", rig.exchange != ModbusExchange::read_write || !rig.input_registers,
             "is read_write, which reads holding registers only",
             "use exchange: separate, or table: holding");
  keys.check("response_timeout_s", rig.response_timeout_s < rig_file.watchdog_s, "is not below watchdog_s",
             "set it to less than watchdog_s");
}

template <Backend link>
void keys_of_link(YamlKeys& document, RigFile& rig) {
  document.needs("backend",
                 !roles_of(rig, Backend::modbus_tcp).any() || !roles_of(rig, Backend::modbus_rtu).any(),
                 "names both Modbus links", "use either modbus-tcp or modbus-rtu");
  document.section_of("modbus", rig.modbus,
                      [&](YamlKeys& keys, ModbusRig& modbus) { modbus_keys(keys, link, rig, modbus); });
}

std::unique_ptr<Rig> make_modbus(const RigFile& rig, double period_s) {
  return std::make_unique<ModbusTransport>(rig, period_s);
}

}  // namespace

int DeviceWatchdog::counts() const {
  return std::max(1, static_cast<int>(std::nearbyint(time_s / seconds_per_count)));
}

std::optional<int> DeviceSampling::counts(double period_s) const {
  constexpr double max_counts = 65535.0, as_good_as_whole = 1e-6;
  const double exact = period_s / seconds_per_count, whole = std::nearbyint(exact);
  if (whole < 1.0 || whole > max_counts || std::abs(exact / whole - 1.0) > as_good_as_whole)
    return std::nullopt;
  return static_cast<int>(whole);
}

bool baud_is_known(int baud) {
  static constexpr std::array known = {
      110,    300,    600,    1200,   2400,    4800,    9600,    19200,   38400,   57600,   115200,  230400,
      460800, 500000, 576000, 921600, 1000000, 1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000};
  return std::find(known.begin(), known.end(), baud) != known.end();
}

BackendKind modbus_tcp_backend() {
  constexpr Backend link = Backend::modbus_tcp;
  return {"modbus-tcp", keys_of_link<link>, make_modbus};
}

BackendKind modbus_rtu_backend() {
  constexpr Backend link = Backend::modbus_rtu;
  return {"modbus-rtu", keys_of_link<link>, make_modbus};
}

}  // namespace upright
