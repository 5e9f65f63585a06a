// Rig files: the shipped ones read, what is written reads back, and what cannot be meant is refused with
// file, line, key and remedy.
#include "upright/hal/rig_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <sstream>

#include "upright/model/error.hpp"

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
}

TEST(RigFile, WrittenTextReadsBackExactly) {
  for (const char* name : {"simulated.yaml", "modbus-tcp.yaml", "modbus-rtu.yaml"}) {
    const std::string text = rig_text(read_rig_file(rigs / name));
    EXPECT_EQ(rig_text(read_rig(YamlMap::from_text(text, "again.yaml"))), text);
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

struct Malformed {
  const char* from;
  const char* to;
  const char* says;  // a part of the sentence
};

TEST(RigFile, RefusesWhatCannotBeMeant) {
  const Malformed cases[] = {
      {"backend: modbus-tcp", "backend: modbus", "did you mean modbus-"},
      {"backend: modbus-tcp", "backend: {encoders: modbus-tcp}", "add output"},
      {"backend: modbus-tcp", "backend: {encoders: modbus-tcp, output: modbus-rtu}", "use one of"},
      {"backend: modbus-tcp", "backend: modbus-rtu", "add device"},
      {"m_per_count: 2.27485e-5", "m_per_count: .nan", "is not finite"},
      {"m_per_count: 2.27485e-5", "m_per_count: 0", "m_per_count"},
      {"m_per_count", "m_per_counts", "add m_per_count"},
      {"sign: 1", "sign: 0", "give sign 1 or -1"},
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
      {"host: 127.0.0.1", "host: [127, 0, 0, 1]", "is not a text"},
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
      {"registers: 2", "registers: 1", "width_bits 16"},
      {"registers: 2", "registers: 3", "registers"},
      {"word_order: high_first", "word_order: big", "high_first"},
      {"boot_count_address: 4", "boot_count_address: 3", "shares a register"},
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
      {"watchdog_s: 0.1", "watchdog_s: 0.1\nwatchdog_s: 0.2", "stands twice"},
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

TEST(RigFile, WithoutQuantisationCountsAreFiner) {
  RigFile rig = read_rig_file(rigs / "simulated.yaml");
  EXPECT_EQ(calibration_in_use(rig).cart.per_count, rig.calibration.cart.per_count);
  rig.simulated->quantise = false;
  EXPECT_EQ(calibration_in_use(rig).cart.per_count, rig.calibration.cart.per_count / 1024);
}

}  // namespace
}  // namespace upright
