// Rigs joined of a real Modbus link, to the virtual rig as a second process, and a Comedi card that exists
// only here: what each part is sent, and that a lost part is a fault of the whole.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "../unit/fake_comedi.hpp"
#include "fresh_reading.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/rig_factory.hpp"
#include "virtual_rig_process.hpp"

namespace upright::test {
namespace {

using namespace std::chrono_literals;
const std::string rigs = UPRIGHT_SOURCE_DIR "/config/rigs/";
const std::string card = "/dev/comedi0";
constexpr double period_s = 0.02;

struct Link {
  const char* name;
  bool serial;
};

void PrintTo(const Link& link, std::ostream* out) {
  *out << link.name;
}

/// The virtual rig has the whole of a Modbus rig; the joined one uses a part of it.
class JoinedModbus : public testing::TestWithParam<Link> {
 protected:
  JoinedModbus() {
    fake_cards().clear();
    fake_cards()[card] = fake_multiq3();
    file = read_rig_file(rigs + (serial ? "modbus-rtu.yaml" : "modbus-tcp.yaml"));
    file.modbus->response_timeout_s = 0.01;
    file.comedi = read_rig_file(rigs + "comedi-multiq3.yaml").comedi;
    file.amplifier.limit_v = 10.0;
  }

  /// Modbus as one part, the card as the rest.
  std::unique_ptr<Rig> opened(const RigRoles& modbus) {
    const Backend link = serial ? Backend::modbus_rtu : Backend::modbus_tcp;
    file.cart_encoder = modbus.cart ? link : Backend::comedi;
    file.pendulum_encoder = modbus.pendulum ? link : Backend::comedi;
    file.output = modbus.output ? link : Backend::comedi;
    if (modbus.cart) file.comedi->cart.reset();
    if (modbus.pendulum) file.comedi->pendulum.reset();
    if (modbus.output) file.comedi->output.reset();
    if (!modbus.output) {
      file.modbus->enable_address.reset();
      file.modbus->watchdog.reset();
    }
    // What the card counts is as wide as its calibration says.
    if (!modbus.cart) file.calibration.cart.width_bits = 24;
    if (!modbus.pendulum) file.calibration.pendulum.width_bits = 24;
    start();
    auto rig = make_rig(read_rig(YamlMap::from_text(rig_text(file), "joined.yaml")), {period_s});
    rig->open();
    return rig;
  }

  lsampl_t output() { return fake_cards().at(card).subdevices[1].data[0]; }

  bool serial = GetParam().serial;
  Folder folder;
  RigFile file;
  std::unique_ptr<VirtualRigProcess> server;

 private:
  void start() {
    const std::string whole = replaced(text_of(rigs + (serial ? "modbus-rtu.yaml" : "modbus-tcp.yaml")),
                                       serial ? "response_timeout_s: 0.002" : "response_timeout_s: 0.0008",
                                       "response_timeout_s: 0.01");
    server = std::make_unique<VirtualRigProcess>(folder, whole, serial,
                                                 std::vector<std::string>{"--theta0-deg", "-2.5"});
    if (serial)
      file.modbus->device = server->name();
    else
      file.modbus->port = server->port();
  }
};

TEST_P(JoinedModbus, AsEncodersIsNeverSentAVoltage) {
  for (const ModbusExchange exchange : {ModbusExchange::read_write, ModbusExchange::separate}) {
    file.modbus->exchange = exchange;
    file.comedi = read_rig_file(rigs + "comedi-multiq3.yaml").comedi;
    auto rig = opened({true, true, false});
    for (int i = 0; i < 20; ++i) {
      const RigReading reading = fresh_reading(*rig);
      EXPECT_EQ(reading.cart_counts, 0);
      EXPECT_EQ(reading.pendulum_counts, -28);  // -2.5 degrees of 4096 counts a turn
      EXPECT_EQ(rig->write(6.0), RigFault::none);
    }
    EXPECT_EQ(output(), 2867u) << "2 V of -5 to 5, on the card";
    rig->stop();
    EXPECT_EQ(output(), 2048u);
    rig.reset();
    server->end(SIGTERM);
    for (const TraceRow& row : server->trace()) EXPECT_EQ(row.voltage_v, 0.0);
    EXPECT_TRUE(server->trace().back().held) << "nothing has let the pendulum go";
  }
}

TEST_P(JoinedModbus, AsOutputItGetsTheVoltageAndItsCountsDoNotMatter) {
  for (const ModbusExchange exchange : {ModbusExchange::read_write, ModbusExchange::separate}) {
    file = read_rig_file(rigs + (serial ? "modbus-rtu.yaml" : "modbus-tcp.yaml"));
    file.modbus->response_timeout_s = 0.01;
    file.modbus->exchange = exchange;
    file.modbus->boot_count_address.reset();
    file.comedi = read_rig_file(rigs + "comedi-multiq3.yaml").comedi;
    fake_cards()[card].subdevices[4].data = {0x800011, 0x800022, 0, 0};
    auto rig = opened({false, false, true});
    for (int i = 0; i < 10; ++i) {
      const RigReading reading = fresh_reading(*rig);
      EXPECT_EQ(reading.cart_counts, 0x11);
      EXPECT_EQ(reading.pendulum_counts, 0x22);
      rig->write(1.5);
      std::this_thread::sleep_for(5ms);
    }
    rig->stop();
    std::this_thread::sleep_for(50ms);
    rig.reset();
    server->end(SIGTERM);
    double highest_v = 0.0;
    for (const TraceRow& row : server->trace()) highest_v = std::max(highest_v, row.voltage_v);
    EXPECT_EQ(highest_v, 1.5);
    EXPECT_EQ(server->trace().back().voltage_v, 0.0);
  }
}

TEST_P(JoinedModbus, CountsOneEncoderWhileTheCardCountsTheOther) {
  for (const ModbusExchange exchange : {ModbusExchange::read_write, ModbusExchange::separate}) {
    file.modbus->exchange = exchange;
    file.modbus->boot_count_address.reset();
    file.comedi = read_rig_file(rigs + "comedi-multiq3.yaml").comedi;
    fake_cards()[card].subdevices[4].data = {0x800033, 0, 0, 0};
    auto rig = opened({false, true, false});
    const RigReading reading = fresh_reading(*rig);
    EXPECT_EQ(reading.cart_counts, 0x33);
    EXPECT_EQ(reading.pendulum_counts, -28);
    rig.reset();
    server->end(SIGTERM);
  }
}

TEST_P(JoinedModbus, ALostOutputIsAFaultAlthoughTheEncodersAreFresh) {
  file.modbus->boot_count_address.reset();
  auto rig = opened({false, false, true});
  fresh_reading(*rig);
  server->end(SIGKILL);
  RigReading reading = rig->read();
  for (int i = 0; i < 100 && reading.status != RigStatus::fault; ++i) {
    EXPECT_NE(reading.status, RigStatus::fresh);
    reading = rig->read();
  }
  EXPECT_EQ(reading.status, RigStatus::fault);
  EXPECT_TRUE(reading.fault == RigFault::link_lost || reading.fault == RigFault::link_timeout)
      << static_cast<int>(reading.fault);
}

TEST_P(JoinedModbus, LostEncodersAreAFaultAndTheOutputStops) {
  auto rig = opened({true, true, false});
  fresh_reading(*rig);
  rig->write(6.0);
  server->end(SIGKILL);
  RigReading reading = rig->read();
  EXPECT_NE(reading.status, RigStatus::fresh);
  EXPECT_EQ(output(), 2867u);
  rig->stop();
  EXPECT_EQ(output(), 2048u);
}

INSTANTIATE_TEST_SUITE_P(Links, JoinedModbus, testing::Values(Link{"tcp", false}, Link{"rtu", true}),
                         [](const auto& item) { return std::string(item.param.name); });

}  // namespace
}  // namespace upright::test
