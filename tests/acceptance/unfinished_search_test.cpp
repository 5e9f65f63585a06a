// Searches that do not come to their end: by a signal, by their bound, and on experiments that were broken
// off. What was found until then is told for what it is.
#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
const std::string model = config + "plants/viscous.yaml";

/// An experiment of two short pieces on the shipped simulated rig, whose friction the model lacks.
fs::path experiment_in(const TemporaryFolder& folder, double duration_s) {
  const std::string piece =
      "    - {kind: multisine, lowest_hz: 0.5, highest_hz: 6, lines: 8, fit_to_travel: true, duration_s: " +
      std::to_string(duration_s);
  const fs::path file = folder.write(
      "short.yaml", "experiment:\n  name: short\n  why: a test\n  plant: " + config +
                        "plants/exponential.yaml\n  travel_m: 0.3\n  voltage_limit_v: 10\n  pieces:\n" +
                        piece + ", amplitude_v: 4}\n" + piece + ", amplitude_v: 3}\n");
  const fs::path out = folder.path() / "experiment";
  const CommandResult made = run_upright("experiment " + file.string() + " --rig " + config +
                                         "rigs/simulated.yaml --fast --rate 250 --out " + out.string());
  EXPECT_EQ(made.exit_code, 0) << made.err;
  return out;
}

/// Runs in the background, sends a signal after `after_s`, and says what came of it and how long it took.
struct Signalled {
  CommandResult result;
  double seconds = 0.0;  ///< from the signal to the end
};
Signalled signalled(const std::string& arguments, const std::string& signal, double after_s) {
  const CommandResult done = run_shell(
      shell_quoted(UPRIGHT_BINARY) + " " + arguments + " & pid=$!\nsleep " + std::to_string(after_s) +
      "\nfrom=$(date +%s%N); kill -" + signal + " $pid; wait $pid; code=$?\n" +
      "echo \"took $(( ($(date +%s%N) - from) / 1000000 ))\" >&2; exit $code");
  Signalled said{done};
  const std::size_t at = done.err.rfind("took ");
  if (at != std::string::npos) said.seconds = std::stod(done.err.substr(at + 5)) * 1e-3;
  return said;
}

constexpr double soon_s = 2.0;

TEST(UnfinishedSearch, DiagnoseAnswersASignalWithWhatItHasFound) {
  const TemporaryFolder folder;
  const fs::path data = experiment_in(folder, 60.0), out = folder.path() / "diagnosis";
  const Signalled ended = signalled(
      "diagnose --model " + model + " --data " + data.string() + " --out " + out.string() + " --json", "INT",
      3.0);
  EXPECT_EQ(ended.result.exit_code, 3) << ended.result.err;
  EXPECT_LT(ended.seconds, soon_s);
  const Json document = Json::parse(ended.result.out);
  EXPECT_EQ(document.at("interrupted"), true);
  EXPECT_EQ(document.at("verdict"), "unexplained");
  EXPECT_EQ(document, Json::parse(read_text(out / "diagnosis.json")));
  EXPECT_EQ(run_upright("check " + (out / "model.yaml").string()).exit_code, 0);
}

TEST(UnfinishedSearch, IdentifyAnswersASignalWithWhatItHasFound) {
  const TemporaryFolder folder;
  const fs::path data = experiment_in(folder, 60.0), out = folder.path() / "identified";
  const Signalled ended = signalled(
      "identify --data " + data.string() + " --plant " + model + " --out " + out.string() + " --json", "TERM",
      3.0);
  EXPECT_EQ(ended.result.exit_code, 3) << ended.result.err;
  EXPECT_LT(ended.seconds, soon_s);
  const Json document = Json::parse(ended.result.out);
  EXPECT_EQ(document.at("interrupted"), true);
  EXPECT_NE(document.at("verdict"), "explained");
  EXPECT_EQ(document.at("trustworthy"), false);
  EXPECT_FALSE(fs::exists(out / "plant.yaml"));
}

TEST(UnfinishedSearch, ItsAnswerIsTheSameOnAnyNumberOfCores) {
  const TemporaryFolder folder;
  const fs::path data = experiment_in(folder, 6.0);
  std::string said;
  for (const char* threads : {"1", "3"}) {
    setenv("UPRIGHT_THREADS", threads, 1);
    const CommandResult result =
        run_upright("diagnose --model " + model + " --data " + data.string() + " --effort 150 --json");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Json::parse(result.out).at("bound_reached"), true);
    EXPECT_TRUE(said.empty() || said == result.out);
    said = result.out;
  }
  unsetenv("UPRIGHT_THREADS");
}

TEST(UnfinishedSearch, TakesWholePiecesAndNamesTheOthers) {
  const TemporaryFolder folder;
  const fs::path data = experiment_in(folder, 6.0);
  // As if the second piece had been broken off: its run is there, and not among the trials.
  std::string trials = read_text(data / "trials.csv");
  trials.erase(trials.rfind('\n', trials.size() - 2) + 1);
  folder.write("experiment/trials.csv", trials);
  for (const std::string& command : {"diagnose --model " + model, "identify --plant " + model}) {
    const CommandResult result = run_upright(command + " --data " + data.string() + " --json");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const std::string notes = Json::parse(result.out).at("notes").dump();
    EXPECT_NE(notes.find("is left out: its piece was interrupted"), std::string::npos) << notes;
  }
  folder.write("experiment/trials.csv", trials.substr(0, trials.find('\n') + 1));
  const CommandResult none = run_upright("diagnose --model " + model + " --data " + data.string());
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("no completed piece"), std::string::npos) << none.err;
}

}  // namespace
}  // namespace upright::testing
