// A device whose watchdog register comes back wrong after the connection was lost: once is a wrong bit, again
// and again is a device that restarted.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <modbus/modbus.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <memory>
#include <thread>

#include "fresh_reading.hpp"
#include "upright/hal/rig_factory.hpp"
#include "virtual_rig_process.hpp"

namespace upright::test {
namespace {

constexpr int watchdog_address = 18;

class Device {
 public:
  Device()
      : context_(modbus_new_tcp("127.0.0.1", 0)), registers_(modbus_mapping_new(0, 0, max_registers, 0)) {
    listener_ = modbus_tcp_listen(context_, 1);
    thread_ = std::thread([this] { serve(); });
  }
  ~Device() {
    ending_ = true;
    hang_up();
    ::shutdown(listener_, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
    modbus_mapping_free(registers_);
    modbus_free(context_);
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  int port() const {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    return ntohs(address.sin_port);
  }
  /// So many readings of the watchdog's register have a wrong bit.
  void misread_watchdog(int times) { wrong_ = times; }
  /// So many requests for the counters are answered with an exception.
  void refuse(int times) { refusals_ = times; }
  /// With so many requests, after so many others.
  void hang_up(int times = 1, int after = 0) {
    answers_ = after;
    hang_ups_ = times;
  }

 private:
  static constexpr int max_registers = 40;

  void serve() {
    while (!ending_) {
      int listener = listener_;
      if (modbus_tcp_accept(context_, &listener) < 0) continue;
      std::uint8_t request[MODBUS_TCP_MAX_ADU_LENGTH];
      for (int size = 0; (size = modbus_receive(context_, request)) >= 0 && !hangs_up();)
        answer(request, size);
      modbus_close(context_);
    }
  }

  bool hangs_up() {
    if (hang_ups_ == 0 || answers_-- > 0) return false;
    --hang_ups_;
    return true;
  }

  void answer(const std::uint8_t* request, int size) {
    const int function = modbus_get_header_length(context_);
    const int address = 256 * request[function + 1] + request[function + 2];
    if (request[function] == MODBUS_FC_WRITE_AND_READ_REGISTERS && refusals_-- > 0) {
      modbus_reply_exception(context_, request, MODBUS_EXCEPTION_SLAVE_OR_SERVER_FAILURE);
      return;
    }
    const bool asks_watchdog =
        request[function] == MODBUS_FC_READ_HOLDING_REGISTERS && address == watchdog_address;
    const auto wrong_bit = static_cast<std::uint16_t>(asks_watchdog && wrong_-- > 0 ? 1 : 0);
    registers_->tab_registers[watchdog_address] ^= wrong_bit;
    modbus_reply(context_, request, size, registers_);
    registers_->tab_registers[watchdog_address] ^= wrong_bit;
  }

  modbus_t* context_;
  modbus_mapping_t* registers_;
  int listener_ = -1;
  std::atomic<bool> ending_{false};
  std::atomic<int> hang_ups_{0}, answers_{0};
  std::atomic<int> wrong_{0}, refusals_{0};
  std::thread thread_;
};

class ModbusMisread : public testing::Test {
 protected:
  ModbusMisread() {
    std::string text = replaced(text_of(UPRIGHT_SOURCE_DIR "/config/rigs/modbus-tcp.yaml"), "port: 1502",
                                "port: " + std::to_string(device.port()));
    // The machine may be busy: what is tested here is what is done, not how fast.
    text = replaced(text, "response_timeout_s: 0.0008", "response_timeout_s: 0.9");
    text = replaced(text, "watchdog_s: 0.1", "watchdog_s: 1.0");
    std::ofstream(folder / "rig.yaml") << text;
    rig = make_rig(read_rig_file(folder / "rig.yaml"), {2.0});
    rig->open();
    fresh_reading(*rig);
  }

  /// The fault of the last of so many readings.
  RigFault fault_after(int readings) {
    RigReading reading;
    for (int i = 0; i < readings; ++i) {
      reading = rig->read();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return reading.fault;
  }

  Device device;
  Folder folder;
  std::unique_ptr<Rig> rig;
};

TEST_F(ModbusMisread, ADeviceThatHangsUpForAWhileIsOpenedAllTheSame) {
  for (const int answered_before : {1, 2, 3, 4}) {
    device.hang_up(10, answered_before);
    EXPECT_NO_THROW(rig->open()) << answered_before;
    EXPECT_EQ(fresh_reading(*rig).fault, RigFault::none);
  }
}

TEST_F(ModbusMisread, AWrongBitIsNoRestart) {
  device.misread_watchdog(2);
  device.hang_up();
  fault_after(10);
  EXPECT_EQ(fresh_reading(*rig).fault, RigFault::none);
}

TEST_F(ModbusMisread, AWatchdogThatStaysAnotherIsARestartForGood) {
  constexpr int again_and_again = 1000;
  device.misread_watchdog(again_and_again);
  device.hang_up();
  EXPECT_EQ(fault_after(30), RigFault::device_restarted);
  device.misread_watchdog(0);
  EXPECT_EQ(fault_after(3), RigFault::device_restarted) << "latched";
}

TEST_F(ModbusMisread, ARefusalIsBelievedTheThirdTime) {
  device.refuse(3);
  EXPECT_EQ(fault_after(1), RigFault::corrupt_reply);
  EXPECT_EQ(fault_after(1), RigFault::corrupt_reply);
  EXPECT_EQ(fault_after(1), RigFault::device_refused);
  EXPECT_EQ(fresh_reading(*rig).fault, RigFault::none);
  device.refuse(2);
  fault_after(2);
  EXPECT_EQ(fresh_reading(*rig).fault, RigFault::none);
  device.refuse(1);
  EXPECT_EQ(fault_after(1), RigFault::corrupt_reply) << "counted anew";
}

}  // namespace
}  // namespace upright::test
