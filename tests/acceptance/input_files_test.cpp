// What is no regular file in the place of one: each command refuses it at once and says which file it is and
// what it is instead.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <functional>
#include <string>
#include <vector>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";

void put_fifo(const fs::path& file) {
  fs::remove_all(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0) << file;
}

void put_socket(const fs::path& file) {
  fs::remove_all(file);
  const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  file.string().copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0) << file;
  ::close(socket);
}

void put_device(const fs::path& file) {
  fs::remove_all(file);
  fs::create_symlink("/dev/zero", file);
}

void put_folder(const fs::path& file) {
  fs::remove_all(file);
  fs::create_directory(file);
}

class InputFiles : public ::testing::Test {
 protected:
  /// `timeout` ends what waits for ever.
  static CommandResult run_bounded(const std::string& arguments) {
    return run_shell("timeout 20 " + shell_quoted(UPRIGHT_BINARY) + " " + arguments);
  }
  static std::string quoted(const fs::path& path) { return shell_quoted(path.string()); }

  /// A run of half a second.
  fs::path make_run() {
    const CommandResult made =
        run_upright("run --rig " + config + "rigs/simulated.yaml --gains " + config +
                    "gains/exponential.yaml --duration 0.5 --fast --out " + quoted(folder_.path() / "runs"));
    EXPECT_EQ(made.exit_code, 0) << made.err;
    return fs::directory_iterator(folder_.path() / "runs")->path();
  }

  /// Each of the four in the place of `file`.
  void expect_refused(const std::string& arguments, const fs::path& file) {
    const struct {
      const char* words;
      std::function<void(const fs::path&)> put;
    } kinds[] = {
        {"named pipe", put_fifo}, {"socket", put_socket}, {"device", put_device}, {"folder", put_folder}};
    for (const auto& kind : kinds) {
      kind.put(file);
      const CommandResult result = run_bounded(arguments);
      EXPECT_EQ(result.exit_code, 2) << arguments << "\n" << result.out << result.err;
      EXPECT_NE(result.err.find(file.filename().string()), std::string::npos) << result.err;
      // A folder that was typed for data could be a run directory: it is one that lacks its files.
      if (kind.words == std::string("folder") && arguments.find("--data") != std::string::npos) continue;
      EXPECT_NE(result.err.find(kind.words), std::string::npos) << arguments << "\n" << result.err;
    }
    fs::remove_all(file);
  }

  TemporaryFolder folder_;
};

TEST_F(InputFiles, OfARunAreRegular) {
  const fs::path run = make_run();
  const std::string samples = read_text(run / "samples.csv");
  for (const char* command : {"replay ", "report "})
    expect_refused(command + quoted(run), run / "samples.csv");
  expect_refused("diagnose --model " + config + "plants/viscous.yaml --data " + quoted(run),
                 run / "samples.csv");
  folder_.write("runs/" + run.filename().string() + "/samples.csv", samples);
  for (const char* command : {"replay ", "report "}) expect_refused(command + quoted(run), run / "run.yaml");
}

TEST_F(InputFiles, ThatAreTypedAreRegular) {
  const fs::path file = folder_.path() / "input.yaml";
  const std::string name = quoted(file), plant = config + "plants/exponential.yaml",
                    rig = config + "rigs/simulated.yaml", gains = config + "gains/exponential.yaml";
  for (const std::string& arguments :
       {"check " + name, "design " + name, "margin " + name + " " + gains, "margin " + plant + " " + name,
        "run --fast --rig " + name + " --gains " + gains, "run --fast --rig " + rig + " --gains " + name,
        "sweep " + name, "experiment " + name + " --rig " + rig,
        "diagnose --model " + plant + " --data " + name, "identify --plant " + plant + " --data " + name,
        "diagnose --model " + name + " --data " + plant, "doctor --seconds 0.1 --rig " + name})
    expect_refused(arguments, file);
  const fs::path table = folder_.path() / "input.csv";
  expect_refused("diagnose --model " + plant + " --data " + quoted(table), table);
}

TEST_F(InputFiles, ThatAReportIsMadeOfAreRegular) {
  folder_.write("sweep/sweep.csv", "");
  expect_refused("report " + quoted(folder_.path() / "sweep"), folder_.path() / "sweep" / "sweep.csv");
  folder_.write("diagnosis/diagnosis.json", "");
  expect_refused("report " + quoted(folder_.path() / "diagnosis"),
                 folder_.path() / "diagnosis" / "diagnosis.json");
}

TEST_F(InputFiles, ThatAnEarlierCallLeftAreRegular) {
  const fs::path out = folder_.path() / "out";
  fs::create_directories(out);
  expect_refused("sweep " + config + "sweeps/exponential.yaml --out " + quoted(out), out / "sweep.partial");
  expect_refused("experiment " + config + "experiments/pivot.yaml --fast --rig " + config +
                     "rigs/simulated.yaml --out " + quoted(out),
                 out / "experiment.yaml");
}

}  // namespace
}  // namespace upright::testing
