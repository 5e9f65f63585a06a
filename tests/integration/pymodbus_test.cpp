// An independent Modbus server (pymodbus) gives our client the same counts and gets the same voltage. The
// virtual environment is made by CMake's fixture before this runs; where PyPI cannot be reached it is skipped
// and says so.
#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>

#include "upright/hal/rig_factory.hpp"
#include "virtual_rig_process.hpp"

namespace upright::test {
namespace {

using namespace std::chrono_literals;

int free_port() {
  const int listener = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  bind(listener, reinterpret_cast<sockaddr*>(&address), size);
  getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
  close(listener);
  return ntohs(address.sin_port);
}

/// Two pseudo-terminals joined end to end: a serial cable between two programs.
class SerialCable {
 public:
  SerialCable() {
    for (End& end : ends_) {
      end.near = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
      std::array<char, 128> name{};
      if (end.near < 0 || grantpt(end.near) != 0 || unlockpt(end.near) != 0 ||
          ptsname_r(end.near, name.data(), name.size()) != 0)
        throw std::runtime_error("no pseudo-terminal");
      end.name = name.data();
      end.far = open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);  // kept, so that nobody's close hangs up
      termios settings{};
      tcgetattr(end.far, &settings);
      cfmakeraw(&settings);
      tcsetattr(end.far, TCSANOW, &settings);
    }
    thread_ = std::thread([this] { carry(); });
  }
  ~SerialCable() {
    ending_ = true;
    thread_.join();
    for (const End& end : ends_) {
      close(end.far);
      close(end.near);
    }
  }
  SerialCable(const SerialCable&) = delete;
  SerialCable& operator=(const SerialCable&) = delete;
  const std::string& name(std::size_t end) const { return ends_[end].name; }

 private:
  struct End {
    int near = -1, far = -1;
    std::string name;
  };

  void carry() {
    while (!ending_) {
      std::array<pollfd, 2> watched{pollfd{ends_[0].near, POLLIN, 0}, pollfd{ends_[1].near, POLLIN, 0}};
      poll(watched.data(), watched.size(), 20);
      for (std::size_t i = 0; i < 2; ++i) {
        if ((watched[i].revents & POLLIN) == 0) continue;
        std::array<char, 512> bytes;
        const ssize_t count = read(ends_[i].near, bytes.data(), bytes.size());
        if (count > 0 && write(ends_[1 - i].near, bytes.data(), static_cast<std::size_t>(count)) != count)
          ADD_FAILURE() << "the cable lost bytes";
      }
    }
  }

  std::array<End, 2> ends_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

struct Exchange {
  const char* name;
  bool serial, separate, input;
};

void PrintTo(const Exchange& exchange, std::ostream* out) {
  *out << exchange.name;
}

class Pymodbus : public testing::TestWithParam<Exchange> {};

TEST_P(Pymodbus, GivesTheSameCountsBack) {
  if (std::system(UPRIGHT_PYTHON " -c 'import pymodbus, serial' 2>/dev/null") != 0)
    GTEST_SKIP()
        << "NOT TESTED: there is no virtual environment with pymodbus. See the test pymodbus_environment";
  const Exchange& exchange = GetParam();
  const SerialCable cable;
  const int port = free_port();
  Process server({UPRIGHT_PYTHON, UPRIGHT_SOURCE_DIR "/tests/integration/pymodbus_server.py",
                  exchange.serial ? cable.name(0) : std::to_string(port)});
  ASSERT_EQ(server.line(), "ready");

  Folder folder;
  std::string text = text_of(UPRIGHT_SOURCE_DIR "/config/rigs/" +
                             std::string(exchange.serial ? "modbus-rtu" : "modbus-tcp") + ".yaml");
  text = exchange.serial
             ? replaced(replaced(text, "/dev/ttyUSB0", cable.name(1)), "baud: 921600", "baud: 115200")
             : replaced(text, "port: 1502", "port: " + std::to_string(port));
  // It is Python, and speed is not the matter.
  text = replaced(text, exchange.serial ? "response_timeout_s: 0.002" : "response_timeout_s: 0.0008",
                  "response_timeout_s: 0.5");
  text = replaced(text, "watchdog_s: 0.1", "watchdog_s: 1.0");
  if (exchange.separate) text = replaced(text, "exchange: read_write", "exchange: separate");
  if (exchange.input) text = replaced(text, "table: holding", "table: input");
  const std::filesystem::path file = folder / "rig.yaml";
  std::ofstream(file) << text;
  auto rig = make_rig(read_rig_file(file), {1.0});
  rig->open();
  for (int i = 0; i < 20; ++i) {
    const RigReading reading = rig->read();
    ASSERT_EQ(reading.status, RigStatus::fresh);
    EXPECT_EQ(reading.cart_counts, -123456);
    EXPECT_EQ(reading.pendulum_counts, 70001);
  }
  rig->write(-3.21);
  std::this_thread::sleep_for(500ms);
  rig.reset();
  server.end(SIGTERM);
  const std::string said = server.rest();
  EXPECT_NE(said.find("voltage " + std::to_string(65536 - 3210)), std::string::npos) << said;
  EXPECT_EQ(said.substr(said.rfind("voltage")), "voltage 0\n") << "stopped at zero volts";
}

INSTANTIATE_TEST_SUITE_P(Exchanges, Pymodbus,
                         testing::Values(Exchange{"tcp_read_write", false, false, false},
                                         Exchange{"tcp_separate", false, true, false},
                                         Exchange{"tcp_input", false, true, true},
                                         Exchange{"rtu_read_write", true, false, false},
                                         Exchange{"rtu_separate", true, true, false},
                                         Exchange{"rtu_input", true, true, true}),
                         [](const auto& item) { return std::string(item.param.name); });

}  // namespace
}  // namespace upright::test
