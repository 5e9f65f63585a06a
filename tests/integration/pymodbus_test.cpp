// An independent Modbus server (pymodbus) gives our client the same counts and gets the same voltage. The
// virtual environment is made by CMake's fixture before this runs; without it the test fails and says so.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <chrono>
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

class Pymodbus : public testing::TestWithParam<const char*> {};

TEST_P(Pymodbus, GivesTheSameCountsBack) {
  ASSERT_TRUE(std::filesystem::exists(UPRIGHT_PYTHON))
      << "the virtual environment with pymodbus is missing: see the test pymodbus_environment";
  const int port = free_port();
  Process server(
      {UPRIGHT_PYTHON, UPRIGHT_SOURCE_DIR "/tests/integration/pymodbus_server.py", std::to_string(port)});
  ASSERT_EQ(server.line(), "ready");

  Folder folder;
  std::string text = text_of(UPRIGHT_SOURCE_DIR "/config/rigs/modbus-tcp.yaml");
  text = replaced(text, "port: 1502", "port: " + std::to_string(port));
  text = replaced(text, "response_timeout_s: 0.0008",
                  "response_timeout_s: 0.09");  // it is Python, and not the matter
  const std::string mode = GetParam();
  if (mode != "read_write") text = replaced(text, "exchange: read_write", "exchange: separate");
  if (mode == "input") text = replaced(text, "table: holding", "table: input");
  const std::filesystem::path file = folder / "rig.yaml";
  std::ofstream(file) << text;
  auto rig = make_rig(read_rig_file(file), {0.2});
  rig->open();
  for (int i = 0; i < 20; ++i) {
    const RigReading reading = rig->read();
    ASSERT_EQ(reading.status, RigStatus::fresh);
    EXPECT_EQ(reading.cart_counts, -123456);
    EXPECT_EQ(reading.pendulum_counts, 70001);
  }
  rig->write(-3.21);
  std::this_thread::sleep_for(100ms);
  rig.reset();
  server.end(SIGTERM);
  const std::string said = server.rest();
  EXPECT_NE(said.find("voltage " + std::to_string(65536 - 3210)), std::string::npos) << said;
  EXPECT_EQ(said.substr(said.rfind("voltage")), "voltage 0\n") << "stopped at zero volts";
}

INSTANTIATE_TEST_SUITE_P(Exchanges, Pymodbus, testing::Values("read_write", "separate", "input"),
                         [](const auto& item) { return std::string(item.param); });

}  // namespace
}  // namespace upright::test
