// Rig files: the shipped ones read, what is written reads back, and what cannot be meant is refused with
// file, line, key and remedy.
#include "upright/hal/rig_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <sstream>

#include "upright/base/error.hpp"

namespace upright {
namespace {

const std::filesystem::path rigs = std::filesystem::path(UPRIGHT_SOURCE_DIR) / "config" / "rigs";

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string refusal(const std::string& text) {
  try {
    read_rig(YamlMap::from_text(text, "rig.yaml"));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

/// The TCP rig file with one piece of it replaced.
std::string changed(const std::string& from, const std::string& to, const char* name = "modbus-tcp.yaml") {
  std::string text = text_of(rigs / name);
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

struct Malformed {
  const char* from;
  const char* to;
  const char* says;  // a part of the sentence
};

TEST(RigFile, ShippedFilesRead) {
  const RigFile simulated = read_rig_file(rigs / "simulated.yaml");
  EXPECT_EQ(simulated.cart_encoder, Backend::simulated);
  EXPECT_TRUE(std::filesystem::exists(simulated.simulated->plant));
  const RigFile tcp = read_rig_file(rigs / "modbus-tcp.yaml");
  EXPECT_EQ(tcp.modbus->host, "127.0.0.1");
  EXPECT_EQ(tcp.modbus->watchdog->counts(), 100);
  const RigFile rtu = read_rig_file(rigs / "modbus-rtu.yaml");
  EXPECT_EQ(rtu.modbus->baud, 921600);
  EXPECT_DOUBLE_EQ(rtu.calibration.cart.per_count, 2.27485e-5);
  const RigFile multiq3 = read_rig_file(rigs / "comedi-multiq3.yaml");
  EXPECT_TRUE(roles_of(multiq3, Backend::comedi).all());
  EXPECT_EQ(multiq3.comedi->pendulum->channel, 1);
  EXPECT_EQ(multiq3.comedi->output->device, "/dev/comedi0");
  EXPECT_EQ(multiq3.comedi->output->amplifier_gain, 3.0);
  const RigFile joined = read_rig_file(rigs / "comedi-and-modbus.yaml");
  EXPECT_EQ(backends_text(joined), "encoders comedi, output modbus-tcp");
  EXPECT_EQ(joined.comedi->cart->lines->b, 10);
  EXPECT_FALSE(joined.comedi->output);
  const RigFile lines = read_rig_file(rigs / "gpio-and-modbus.yaml");
  EXPECT_EQ(lines.gpio->emergency_stop->line, 4);
  EXPECT_EQ(lines.gpio->limit_switches.at(1).end, TrackEnd::minus_x);
  EXPECT_EQ(lines.gpio->pendulum_encoder->bias, LineBias::pull_up);
  const RigFile quanser = read_rig_file(rigs / "quanser-q2-usb.yaml");
  EXPECT_TRUE(roles_of(quanser, Backend::quanser_hil).all());
  EXPECT_EQ(quanser.quanser->library, "libhil.so");
  EXPECT_EQ(quanser.quanser->pendulum_channel, 1);
  EXPECT_EQ(quanser.quanser->watchdog_s, 0.05);
}

TEST(RigFile, WrittenTextReadsBackExactly) {
  for (const char* name :
       {"simulated.yaml", "modbus-tcp.yaml", "modbus-rtu.yaml", "comedi-multiq3.yaml",
        "comedi-ni-pcimio.yaml", "comedi-s626.yaml", "comedi-and-modbus.yaml", "gpio-and-modbus.yaml",
        "quanser-q2-usb.yaml", "quanser-q8-usb.yaml", "quanser-qpid-e.yaml"}) {
    const std::string text = rig_text(read_rig_file(rigs / name));
    EXPECT_EQ(rig_text(read_rig(YamlMap::from_text(text, "again.yaml"))), text);
  }
}

/// The shipped Q2-USB with only what the interface asks for.
std::string plain_quanser() {
  std::string text = text_of(rigs / "quanser-q2-usb.yaml");
  for (const char* key : {"  output_range_v:", "  amplifier_gain:"}) {
    const std::size_t at = text.find(key);
    text.erase(at, text.find('\n', at) + 1 - at);
  }
  return text;
}

RigFile quanser_with(const std::string& from, const std::string& to) {
  std::string text = plain_quanser();
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return read_rig(YamlMap::from_text(text.replace(at, from.size(), to), "/rigs/rig.yaml"));
}

TEST(RigFile, AQuansersCountersAreFollowedAtTheirOwnWidth) {
  const RigFile rig = quanser_with("sign: 1, width_bits: 16", "sign: 1, width_bits: 32");
  EXPECT_EQ(rig.calibration.cart.width_bits, 16);
  const RigFile zero = quanser_with("{at: start, pose: hanging}",
                                    "{at: counts, cart_counts: 40000, pendulum_counts: -3, pose: hanging}");
  EXPECT_EQ(signed_counts(zero.calibration.cart_zero_counts, 16), 40000 - 65536);
  EXPECT_EQ(quanser_with("board_type: q2_usb", "board_type: my_card").calibration.cart.width_bits, 16);
}

TEST(RigFile, AQuanserPutsOutNoMoreThanItsRange) {
  EXPECT_EQ(quanser_with("limit_v: 10.0", "limit_v: 15.0").amplifier.limit_v, 10.0);
  EXPECT_EQ(quanser_with("limit_v: 10.0", "limit_v: 6.0").amplifier.limit_v, 6.0);
  EXPECT_EQ(quanser_with("  watchdog_s: 0.05", "  amplifier_gain: 3\n  watchdog_s: 0.05").quanser->watchdog_s,
            0.05);
}

TEST(RigFile, AQuansersCardMayBeTheClock) {
  EXPECT_FALSE(quanser_with("q2_usb", "q2_usb").quanser->is_clock);
  EXPECT_FALSE(quanser_with("q2_usb", "q2_usb\n  clock: computer").quanser->is_clock);
  const RigFile rig = quanser_with("q2_usb", "q2_usb\n  clock: card");
  EXPECT_TRUE(rig.quanser->is_clock);
  EXPECT_TRUE(read_rig(YamlMap::from_text(rig_text(rig), "again.yaml")).quanser->is_clock);
  EXPECT_THROW(quanser_with("q2_usb", "q2_usb\n  clock: device"), ConfigError);
}

/// The board's file with its clock.
std::string board_as_clock() {
  return text_of(rigs / "board.yaml") +
         "  device_clock: {sample_address: 9, period_address: 19, seconds_per_count: 1.0e-6}\n";
}

TEST(RigFile, AModbusDeviceMayBeTheClock) {
  const RigFile rig = read_rig(YamlMap::from_text(board_as_clock(), "rig.yaml"));
  ASSERT_TRUE(rig.modbus->sampling.has_value());
  EXPECT_EQ(rig.modbus->sampling->counts(0.005), 5000);
  EXPECT_EQ(rig.modbus->sampling->counts(1.0 / 300.0), std::nullopt) << "no whole number of microseconds";
  EXPECT_EQ(rig.modbus->sampling->counts(0.066), std::nullopt) << "more than a register holds";
  const std::string text = rig_text(rig);
  EXPECT_EQ(rig_text(read_rig(YamlMap::from_text(text, "again.yaml"))), text);
  EXPECT_FALSE(read_rig_file(rigs / "board.yaml").modbus->sampling);
}

TEST(RigFile, RefusesADeviceClockThatCannotBe) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = board_as_clock();
    return refusal(text.replace(text.find(from), from.size(), to));
  };
  EXPECT_NE(with("exchange: read_write", "exchange: separate").find("use exchange: read_write"),
            std::string::npos);
  EXPECT_NE(with("sample_address: 9", "sample_address: 5").find("shares a register"), std::string::npos);
  EXPECT_NE(with("status_address: 5", "status_address: 11").find("has a sample_address before"),
            std::string::npos);
  EXPECT_NE(with("period_address: 19", "period_address: 18").find("shares a register"), std::string::npos);
}

TEST(RigFile, AQuansersLibraryIsANameOrAPathBesideTheRigFile) {
  EXPECT_EQ(quanser_with("libhil.so ", "../lib/libhil.so ").quanser->library, "/lib/libhil.so");
  const RigFile rig = quanser_with("libhil.so ", "./libhil.so ");
  EXPECT_EQ(rig.quanser->library, "/rigs/libhil.so");
  const std::string text = rig_text(rig);
  EXPECT_EQ(rig_text(read_rig(YamlMap::from_text(text, "again.yaml"))), text);
}

/// A rig file of parts: the Comedi rig's, with another line for the backends and other wiring.
std::string of_parts(const std::string& backend, const std::string& wiring) {
  const std::string text = text_of(rigs / "comedi-multiq3.yaml");
  const std::size_t calibration = text.find("calibration:");
  return "backend: " + backend + "\n" + text.substr(calibration, text.find("comedi:") - calibration) + wiring;
}

const std::string potentiometer =
    "comedi:\n"
    "  pendulum: {kind: analog_input, device: \"/dev/comedi1\", subdevice: 0, channel: 2, range_v: [-5, 5],\n"
    "             reference: difference, counts_per_v: 1000}\n";
const std::string modbus_counters =
    "modbus: {host: 10.0.0.1, port: 502, unit: 1, response_timeout_s: 0.001, exchange: separate,\n"
    "         counters: {table: input, cart_address: 7, registers: 2, word_order: low_first}}\n";
const std::string modbus_output =
    "modbus: {host: 10.0.0.1, port: 502, unit: 1, response_timeout_s: 0.001, exchange: read_write,\n"
    "         voltage: {address: 3, encoding: int16, counts_per_v: 1000}, enable_address: 9}\n";
const std::string gpio_pendulum =
    "gpio: {chip: gpiochip0, pendulum_encoder: {a: 1, b: 2, fastest_edges_per_s: 5000}}\n";
const std::string output_and_cart =
    "comedi:\n"
    "  device: /dev/comedi0\n"
    "  cart: {kind: plain_counter, subdevice: 3, channel: 1}\n"
    "  output: {subdevice: 1, channel: 0, range_v: [-10, 10], amplifier_gain: 1}\n";

TEST(RigFile, RigsOfPartsReadBackExactly) {
  for (const std::string& file :
       {of_parts("{cart_encoder: modbus-tcp, pendulum_encoder: comedi, output: comedi}",
                 potentiometer +
                     "  output: {device: /dev/comedi0, subdevice: 1, channel: 0, range_v: [-10, 10], "
                     "amplifier_gain: 1}\n" +
                     modbus_counters),
        of_parts("{cart_encoder: comedi, pendulum_encoder: gpio, output: modbus-tcp}",
                 "comedi: {device: /dev/comedi0, cart: {kind: plain_counter, subdevice: 3, channel: 1}}\n" +
                     modbus_output + gpio_pendulum),
        of_parts("{cart_encoder: comedi, pendulum_encoder: modbus-tcp, output: comedi}",
                 output_and_cart + "modbus: {host: 10.0.0.1, port: 502, unit: 1, response_timeout_s: 0.001, "
                                   "exchange: separate, counters: {table: holding, pendulum_address: 1, "
                                   "registers: 2, word_order: high_first}, boot_count_address: 0, "
                                   "status_address: 3}\n")}) {
    const std::string text = rig_text(read_rig(YamlMap::from_text(file, "rig.yaml")));
    EXPECT_EQ(rig_text(read_rig(YamlMap::from_text(text, "again.yaml"))), text);
  }
}

TEST(RigFile, APotentiometerHasWhatItNeeds) {
  const RigFile rig = read_rig(YamlMap::from_text(
      of_parts("{cart_encoder: modbus-tcp, pendulum_encoder: comedi, output: modbus-tcp}",
               potentiometer +
                   "modbus: {host: 10.0.0.1, port: 502, unit: 1, response_timeout_s: 0.001, exchange: "
                   "separate, counters: {table: holding, cart_address: 0, registers: 2, word_order: "
                   "high_first}, voltage: {address: 16, encoding: int16, counts_per_v: 1000}}\n"),
      "rig.yaml"));
  ASSERT_TRUE(rig.comedi->pendulum);
  EXPECT_FALSE(rig.comedi->cart);
  EXPECT_EQ(rig.comedi->pendulum->device, "/dev/comedi1");
  EXPECT_EQ(rig.comedi->pendulum->kind, ComediEncoderKind::analog_input);
  EXPECT_EQ(rig.comedi->pendulum->reference, ComediReference::difference);
  EXPECT_EQ(rig.comedi->pendulum->range.low_v, -5.0);
  EXPECT_EQ(rig.comedi->pendulum->counts_per_v, 1000.0);
}

TEST(RigFile, RefusesPartsThatDoNotFit) {
  const std::string good = "{cart_encoder: comedi, pendulum_encoder: gpio, output: comedi}";
  struct Case {
    std::string backend, wiring;
    const char* says;
  };
  const Case cases[] = {
      {"{encoders: simulated, output: comedi}", output_and_cart, "use simulated for all parts or for none"},
      {"{cart_encoder: simulated, pendulum_encoder: simulated, output: comedi}", output_and_cart, "for none"},
      {"{cart_encoder: comedi, output: comedi}", output_and_cart, "add pendulum_encoder"},
      {"{encoders: comedi, cart_encoder: comedi, pendulum_encoder: gpio, output: comedi}", output_and_cart,
       "encoders"},
      {"{cart_encoder: comedi, pendulum_encoder: gpoi, output: comedi}", output_and_cart,
       "did you mean gpio"},
      {"comedi", output_and_cart, "add pendulum"},
      {"{cart_encoder: gpio, pendulum_encoder: gpio, output: comedi}", output_and_cart, "cart"},
      {"{encoders: gpio, output: modbus-tcp}",
       modbus_output.substr(0, modbus_output.rfind('}')) + ", counters: {table: holding}}\n",
       "modbus.counters is not a known key"},
      {"{encoders: modbus-tcp, output: gpio}", modbus_output, "add counters"},
      {"{cart_encoder: modbus-tcp, pendulum_encoder: gpio, output: gpio}",
       modbus_counters.substr(0, modbus_counters.rfind('}')) + ", enable_address: 1}\n", "enable_address"},
      {good, "", "add comedi"},
  };
  for (const Case& item : cases) {
    const std::string sentence = refusal(of_parts(item.backend, item.wiring));
    EXPECT_NE(sentence.find(item.says), std::string::npos) << item.backend << " -> " << sentence;
    EXPECT_NE(sentence.find("rig.yaml:"), std::string::npos) << sentence;
  }
  EXPECT_EQ(refusal(of_parts(good, output_and_cart + gpio_pendulum)), "");
}

TEST(RigFile, RefusesWhatComediCannotMean) {
  const std::string backend = "{cart_encoder: comedi, pendulum_encoder: comedi, output: comedi}";
  const std::string wiring = output_and_cart + potentiometer.substr(potentiometer.find('\n') + 1);
  ASSERT_EQ(refusal(of_parts(backend, wiring)), "");
  const Malformed cases[] = {
      {"kind: plain_counter", "kind: counters", "did you mean counter"},
      {"kind: plain_counter, ", "", "add kind"},
      {"subdevice: 3", "subdevice: -1", "subdevice"},
      {"subdevice: 3, ", "", "add subdevice"},
      {"channel: 1}", "chanel: 1}", "add channel"},
      {"device: /dev/comedi0\n", "\n", "add device: /dev/comedi0"},
      {"plain_counter, subdevice: 3, channel: 1",
       "plain_counter, subdevice: 3, channel: 1, lines: {a: 1, b: 2}", "lines"},
      {"plain_counter, subdevice: 3, channel: 1", "counter, subdevice: 3, channel: 1, lines: {a: 1, b: 1}",
       "use a different line for each"},
      {"plain_counter, subdevice: 3, channel: 1", "counter, subdevice: 3, channel: 1, lines: {a: 1, b: 16}",
       "0 to 15"},
      {"plain_counter, subdevice: 3, channel: 1",
       "plain_counter, device: /dev/comedi1, subdevice: 0, channel: 2", "a different channel for each"},
      {"range_v: [-10, 10]", "range_v: [10, -10]", "lower and the upper end"},
      {"range_v: [-10, 10]", "range_v: 10", "range_v"},
      {"range_v: [-10, 10]", "range_v: [0, 10]", "does not contain zero volts"},
      {"range_v: [-10, 10]", "range_v: [-10, .inf]", "range_v"},
      {"range_v: [-10, 10]", "range_v: [-5, 10]", "amplifier.limit_v to at most 5"},
      {"amplifier_gain: 1", "amplifier_gain: 0", "amplifier_gain"},
      {"amplifier_gain: 1", "gain: 1", "add amplifier_gain"},
      {"reference: difference", "reference: differential", "reference"},
      {"counts_per_v: 1000", "counts_per_v: .nan", "counts_per_v"},
      {"counts_per_v: 1000", "counts_per_v: 2e6", "counts_per_v to at most 1677721"},
      {"counts_per_v: 1000", "counts_per_v: 1000, counts: 3", "remove it"},
  };
  for (const Malformed& item : cases) {
    std::string text = wiring;
    const std::size_t at = text.find(item.from);
    ASSERT_NE(at, std::string::npos) << item.from;
    text.replace(at, std::string(item.from).size(), item.to);
    const std::string sentence = refusal(of_parts(backend, text));
    EXPECT_NE(sentence.find(item.says), std::string::npos) << item.to << " -> " << sentence;
    EXPECT_NE(sentence.find("rig.yaml:"), std::string::npos) << sentence;
  }
}

TEST(RigFile, RandomRigsReadBackExactly) {
  std::mt19937 random(7);
  const auto real = [&](double low, double high) {
    return std::uniform_real_distribution<>(low, high)(random);
  };
  const auto whole = [&](int low, int high) { return std::uniform_int_distribution<>(low, high)(random); };
  for (int i = 0; i < 500; ++i) {
    RigFile rig = read_rig_file(rigs / (i % 2 == 0 ? "modbus-tcp.yaml" : "modbus-rtu.yaml"));
    rig.calibration.cart = {real(1e-6, 1e-3), whole(0, 1) * 2 - 1, 32, real(0.1, 10)};
    rig.calibration.pendulum.per_count = 2 * std::numbers::pi / real(600, 1e5);
    rig.calibration.zero_at_start = whole(0, 1) == 1;
    rig.calibration.zero_pose = static_cast<ZeroPose>(whole(0, 1));
    rig.calibration.cart_zero_counts = rig.calibration.zero_at_start ? 0 : whole(-100000, 100000);
    rig.amplifier = {real(1, 24), whole(0, 1) * 2 - 1};
    rig.track_limit_m = real(0.1, 0.5);
    rig.coast_s = real(0.0, 1.0);
    rig.fall_angle_rad = real(0.1, 1.0);
    rig.watchdog_s = real(0.05, 0.5);
    rig.modbus->voltage = {VoltageEncoding::float32, static_cast<WordOrder>(whole(0, 1)), real(0.1, 100)};
    rig.modbus->enable_address.reset();
    rig.modbus->counter.word_order = static_cast<WordOrder>(whole(0, 1));
    rig.modbus->exchange = static_cast<ModbusExchange>(whole(0, 1));
    rig.modbus->input_registers = rig.modbus->exchange == ModbusExchange::separate && whole(0, 1) == 1;
    if (whole(0, 1) == 1) rig.modbus->watchdog.reset();
    const std::string text = rig_text(rig);
    const RigFile again = read_rig(YamlMap::from_text(text, "again.yaml"));
    EXPECT_EQ(rig_text(again), text);
    EXPECT_EQ(again.calibration.pendulum.per_count, rig.calibration.pendulum.per_count);
    EXPECT_EQ(again.calibration.cart.per_count, rig.calibration.cart.per_count);
  }
}

TEST(RigFile, RefusesWhatCannotBeMeant) {
  const Malformed cases[] = {
      {"backend: modbus-tcp", "backend: modbus", "did you mean modbus-"},
      {"backend: modbus-tcp", "backend: {encoders: modbus-tcp}", "add output"},
      {"backend: modbus-tcp", "backend: {encoders: modbus-tcp, output: modbus-rtu}", "use either"},
      {"backend: modbus-tcp", "backend: modbus-rtu", "add device"},
      {"m_per_count: 2.27485e-5", "m_per_count: .nan", "is not finite"},
      {"m_per_count: 2.27485e-5", "m_per_count: 0", "m_per_count"},
      {"m_per_count", "m_per_counts", "add m_per_count"},
      {"sign: 1", "sign: 0", "use 1 or -1"},
      {"sign: 1", "sign: 2", "sign"},
      {"width_bits: 32", "width_bits: 33", "8 to 32"},
      {"width_bits: 32", "width_bits: 7", "8 to 32"},
      {"width_bits: 32", "width_bits: 15.5", "whole number"},
      {"counts_per_revolution: 4096", "counts_per_revolution: -4096", "counts_per_revolution"},
      {"fastest_mps: 5.0", "fastest_mps: 0", "fastest_mps"},
      {"at: counts", "at: counter", "did you mean counts"},
      {"pose: upright", "pose: down", "hanging"},
      {"cart_counts: 0, ", "", "add cart_counts"},
      {"at: counts, cart_counts: 0, pendulum_counts: 0", "at: start, cart_counts: 0", "not a known key"},
      {"limit_v: 15.0", "limit_v: 0", "limit_v"},
      {"limit_v: 15.0", "limit_v: fifteen", "is not a number"},
      {"limit_v: 15.0", "limit_v: 40.0", "counts_per_v"},
      {"limit_m: 0.4", "limit_m: -0.4", "limit_m"},
      {"coast_s: 0.1", "coast_s: -0.1", "coast_s"},
      {"fall_angle_rad: 0.6", "fall_angle_rad: 0", "fall_angle_rad"},
      {"fall_angle_rad: 0.6", "fall_angle_deg: 35", "fall_angle_rad"},
      {"watchdog_s: 0.1", "watchdog_s: 0", "watchdog_s"},
      {"watchdog_s: 0.1", "watchdog_s: 0.0005", "response_timeout_s"},
      {"port: 1502", "port: 0", "port"},
      {"port: 1502", "port: 70000", "port"},
      {"host: 127.0.0.1", "host: [127, 0, 0, 1]", "is not text"},
      {"unit: 1", "unit: 256", "unit"},
      {"response_timeout_s: 0.0008", "response_timeout_s: 5", "response_timeout_s"},
      {"exchange: read_write", "exchange: readwrite", "did you mean read_write"},
      {"table: holding", "table: input", "read_write, which reads holding registers only"},
      {"table: holding", "table: coils", "table"},
      {"cart_address: 0", "cart_address: -1", "cart_address"},
      {"cart_address: 0", "cart_address: 65536", "cart_address"},
      {"pendulum_address: 2", "pendulum_address: 1", "shares a register"},
      {"pendulum_address: 2", "pendulum_address: 200", "125 registers"},
      {"pendulum_address: 2", "pendulum_address: 65535", "beyond register 65535"},
      {"registers: 2", "registers: 1", "width_bits to 16"},
      {"registers: 2", "registers: 3", "registers"},
      {"word_order: high_first", "word_order: big", "high_first"},
      {"boot_count_address: 4", "boot_count_address: 3", "shares a register"},
      {"boot_count_address: 4", "boot_count_address: 4\n  status_address: 4", "shares a register"},
      {"address: 16", "address: 2", "shares a register"},
      {"enable_address: 17", "enable_address: 16", "shares a register"},
      {"encoding: int16", "encoding: int8", "did you mean int16"},
      {"encoding: int16", "encoding: int32", "add word_order"},
      {"counts_per_v: 1000.0", "counts_per_v: 0", "counts_per_v"},
      {"counts_per_v: 1000.0", "counts_per_v: 4000", "at most"},
      {"time_s: 0.1, seconds", "time_s: 0.0001, seconds", "16-bit"},
      {"time_s: 0.1, seconds", "time_s: 0, seconds", "time_s"},
      {"seconds_per_count: 0.001", "second_per_count: 0.001", "seconds_per_count"},
      {"modbus:\n", "modbus:\n  hots: x\n", "did you mean host"},
      {"watchdog_s: 0.1", "watchdog_s: 0.1\nwatchdog_s: 0.2", "appears twice"},
      {"modbus:\n", "modbuss:\n", "add modbus"},
  };
  for (const Malformed& item : cases) {
    const std::string sentence = refusal(changed(item.from, item.to));
    EXPECT_NE(sentence.find(item.says), std::string::npos) << item.to << " -> " << sentence;
    EXPECT_NE(sentence.find("rig.yaml:"), std::string::npos) << sentence;
  }
  EXPECT_NE(refusal(changed("baud: 921600", "baud: 921000", "modbus-rtu.yaml")).find("standard rate"),
            std::string::npos);
  EXPECT_NE(refusal(changed("parity: none", "parity: mark", "modbus-rtu.yaml")).find("parity"),
            std::string::npos);
  EXPECT_NE(refusal(changed("unit: 1", "unit: 0", "modbus-rtu.yaml")).find("unit"), std::string::npos);
}

TEST(RigFile, RandomLinesReadBackExactly) {
  std::mt19937 random(8);
  const auto whole = [&](int low, int high) { return std::uniform_int_distribution<>(low, high)(random); };
  const auto coin = [&] { return whole(0, 1) == 1; };
  int line = 0;
  const auto input = [&] { return DigitalLine{line++, coin(), static_cast<LineBias>(whole(0, 2))}; };
  for (int i = 0; i < 200; ++i) {
    RigFile rig = read_rig_file(rigs / "gpio-and-modbus.yaml");
    line = whole(0, 50);
    GpioRig gpio;
    gpio.chip = coin() ? "/dev/gpiochip1" : "a \"label\"";
    if (coin()) gpio.emergency_stop = input();
    for (int k = whole(0, 8); k > 0; --k)
      gpio.limit_switches.push_back({static_cast<TrackEnd>(whole(0, 1)), input()});
    if (coin()) gpio.amplifier_enable = DigitalLine{line++, coin(), LineBias::as_is};
    if (coin()) gpio.heartbeat = line++;
    gpio.pendulum_encoder = LineEncoder{line, line + 1, static_cast<LineBias>(whole(0, 2)),
                                        std::uniform_real_distribution<>(100.0, 20000.0)(random)};
    rig.gpio = gpio;
    const std::string text = rig_text(rig);
    const RigFile again = read_rig(YamlMap::from_text(text, "again.yaml"));
    EXPECT_EQ(rig_text(again), text);
    EXPECT_EQ(again.gpio->limit_switches.size(), gpio.limit_switches.size());
    EXPECT_EQ(again.gpio->pendulum_encoder->fastest_edges_per_s, gpio.pendulum_encoder->fastest_edges_per_s);
  }
}

TEST(RigFile, RefusesLinesThatCannotBeMeant) {
  const Malformed cases[] = {
      {"chip: gpiochip0", "chip: \"\"", "set chip to text"},
      {"  chip: gpiochip0", "  chipp: gpiochip0", "did you mean chip"},
      {"line: 4", "line: -1", "line"},
      {"line: 4", "line: 5", "different line for each"},
      {"a: 22", "a: 23", "different line for each"},
      {"a: 22", "a: 18", "different line for each"},
      {"line: 4, active: high", "line: 4", "add active"},
      {"line: 4, active: high", "line: 4, active: closed", "one of"},
      {"active: high, bias: pull_up", "active: high, bias: up", "pull_up"},
      {"line: 17, active: high", "line: 17, active: high, bias: pull_up", "remove it"},
      {"heartbeat: {line: 18}", "heartbeat: {line: 18, active: high}", "remove it"},
      {"end: plus_x", "end: left", "plus_x"},
      {"end: plus_x, ", "", "add end"},
      {"fastest_edges_per_s: 8000.0", "fastest_edges_per_s: 0", "fastest_edges_per_s"},
      {"fastest_edges_per_s: 8000.0", "fastest_edges_per_s: 44000", "20000"},
      {"  pendulum_encoder: {a: 22, b: 23, bias: pull_up, fastest_edges_per_s: 8000.0}\n", "",
       "add pendulum_encoder"},
      {"  pendulum_encoder: {a", "  cart_encoder: {a", "remove cart_encoder"},
      {"pendulum_encoder: gpio", "pendulum_encoder: modbus-tcp", "pendulum_address"},
      {"gpio:\n", "gpoi:\n", "gpio"},
  };
  for (const Malformed& item : cases) {
    const std::string sentence = refusal(changed(item.from, item.to, "gpio-and-modbus.yaml"));
    EXPECT_NE(sentence.find(item.says), std::string::npos) << item.to << " -> " << sentence;
    EXPECT_NE(sentence.find("rig.yaml:"), std::string::npos) << sentence;
  }
  const std::string none = text_of(rigs / "simulated.yaml") + "gpio: {chip: gpiochip0}\n";
  EXPECT_NE(refusal(none).find("add a line"), std::string::npos) << refusal(none);
  const std::string unused =
      text_of(rigs / "simulated.yaml") +
      "gpio: {chip: gpiochip0, pendulum_encoder: {a: 1, b: 2, fastest_edges_per_s: 5000}}\n";
  EXPECT_NE(refusal(unused).find("remove pendulum_encoder"), std::string::npos) << refusal(unused);
  const std::string alone = of_parts("gpio", gpio_pendulum);
  EXPECT_NE(refusal(alone).find("another backend as output"), std::string::npos) << refusal(alone);
}

TEST(RigFile, WithoutQuantisationCountsAreFiner) {
  RigFile rig = read_rig_file(rigs / "simulated.yaml");
  EXPECT_EQ(calibration_in_use(rig).cart.per_count, rig.calibration.cart.per_count);
  rig.simulated->quantise = false;
  EXPECT_EQ(calibration_in_use(rig).cart.per_count, rig.calibration.cart.per_count / 1024);
}

}  // namespace
}  // namespace upright
