// `upright run --stream` and `upright experiment --stream` with a receiver that knows nothing of upright
// (udp_receiver.py).
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>
#include <vector>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string begin_of_run =
    "run --rig " UPRIGHT_SOURCE_DIR "/config/rigs/simulated.yaml --gains " UPRIGHT_SOURCE_DIR
    "/config/gains/exponential-200hz.yaml ";

/// The rows of a samples.csv, by tick: column and cell.
std::map<std::uint64_t, std::map<std::string, std::string>> rows_of(const fs::path& samples) {
  std::ifstream in(samples);
  const auto cells = [](const std::string& line) {
    std::vector<std::string> found;
    std::istringstream words(line);
    for (std::string word; std::getline(words, word, ',');) found.push_back(word);
    return found;
  };
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> names = cells(line);
  std::map<std::uint64_t, std::map<std::string, std::string>> rows;
  while (std::getline(in, line)) {
    const std::vector<std::string> values = cells(line);
    for (std::size_t i = 0; i < names.size(); ++i) rows[std::stoull(values[0])][names[i]] = values[i];
  }
  return rows;
}

std::string wait_for_text(const fs::path& file) {
  for (int i = 0; i < 300 && !fs::exists(file); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  return read_text(file);
}

/// A receiver that writes what it gets to a file, and its port.
std::pair<std::thread, std::string> start_receiver(const TemporaryFolder& folder, const fs::path& received) {
  const fs::path port = folder.path() / "port";
  std::thread receiver([port, received] {
    run_shell("python3 " + shell_quoted(UPRIGHT_SOURCE_DIR "/tests/acceptance/udp_receiver.py") + " " +
              shell_quoted(port.string()) + " " + shell_quoted(received.string()));
  });
  return {std::move(receiver), wait_for_text(port)};
}

TEST(Stream, SendsEveryRowAsTheLogHasIt) {
  const TemporaryFolder folder;
  const fs::path received = folder.path() / "received";
  auto [receiver, number] = start_receiver(folder, received);
  const CommandResult result = run_upright(begin_of_run + "--duration 2 --json --out " +
                                           folder.path().string() + " --stream udp://127.0.0.1:" + number);
  receiver.join();
  // A busy machine may end the run early. What was logged until then must have been sent.
  const Json document = Json::parse(result.out);
  const auto rows = rows_of(fs::path(document.at("run_directory").get<std::string>()) / "samples.csv");
  ASSERT_GT(rows.size(), 0u) << result.err;
  const Json& stream = document.at("stream");
  EXPECT_EQ(stream.at("rows_dropped"), 0);
  EXPECT_EQ(stream.at("rows_sent"), rows.size());
  std::ifstream in(received);
  std::size_t count = 0;
  for (std::string line; std::getline(in, line); ++count) {
    const Json one = Json::parse(line);
    const auto& row = rows.at(one.at("tick").get<std::uint64_t>());
    EXPECT_EQ(one.at("timestamp"), one.at("time_s"));
    EXPECT_EQ(one.size(), row.size() + 1);
    for (const auto& [name, cell] : row)
      EXPECT_EQ(one.at(name).get<double>(), std::strtod(cell.c_str(), nullptr)) << name << " " << cell;
  }
  EXPECT_EQ(count, rows.size());
}

TEST(Stream, SendsTheRowsOfAnExperiment) {
  const TemporaryFolder folder;
  const fs::path received = folder.path() / "received";
  auto [receiver, number] = start_receiver(folder, received);
  std::ofstream(folder.path() / "look.yaml")
      << "experiment:\n  name: look\n  why: A test of the stream.\n  sample_rate_hz: 100\n"
         "  travel_m: 0.3\n  voltage_limit_v: 5\n  pieces:\n    - {kind: observe, duration_s: 1}\n";
  const CommandResult result =
      run_upright("experiment " + (folder.path() / "look.yaml").string() +
                  " --rig " UPRIGHT_SOURCE_DIR "/config/rigs/simulated.yaml --ready --json --out " +
                  (folder.path() / "out").string() + " --stream udp://127.0.0.1:" + number);
  receiver.join();
  const Json document = Json::parse(result.out);
  const fs::path run = document.at("trials").at(0).at("run_directory").get<std::string>();
  const auto rows = rows_of(run / "samples.csv");
  ASSERT_GT(rows.size(), 0u) << result.err;
  EXPECT_EQ(document.at("stream").at("rows_sent"), rows.size());
  std::ifstream in(received);
  std::size_t count = 0;
  for (std::string line; std::getline(in, line); ++count)
    EXPECT_EQ(rows.count(Json::parse(line).at("tick").get<std::uint64_t>()), 1u);
  EXPECT_EQ(count, rows.size());
}

TEST(Stream, CountsRowsThatCannotBeSentAndGoesOn) {
  // A broadcast without permission: every datagram is refused by this machine.
  const TemporaryFolder folder;
  const CommandResult result = run_upright(begin_of_run + "--duration 1 --json --out " +
                                           folder.path().string() + " --stream udp://255.255.255.255:9");
  const Json document = Json::parse(result.out);
  EXPECT_EQ(document.at("stream").at("rows_sent"), 0);
  EXPECT_EQ(document.at("stream").at("rows_dropped"), document.at("rows_written"));
}

TEST(Stream, RefusesWhatIsNoAddress) {
  for (const char* address :
       {"127.0.0.1:9870", "udp://", "udp://:9870", "udp://127.0.0.1", "udp://127.0.0.1:0",
        "udp://127.0.0.1:70000", "tcp://127.0.0.1:9870", "udp://no such host:9870"}) {
    const CommandResult result =
        run_upright(begin_of_run + "--duration 1 --out /nowhere --stream " + shell_quoted(address));
    EXPECT_EQ(result.exit_code, 2) << address;
    EXPECT_FALSE(result.err.empty());
  }
  const CommandResult fast = run_upright(begin_of_run + "--fast --stream udp://127.0.0.1:9870");
  EXPECT_EQ(fast.exit_code, 2);
  EXPECT_NE(fast.err.find("--stream needs real time"), std::string::npos) << fast.err;
}

}  // namespace
}  // namespace upright::testing
