// `upright optimise` as a user meets it: gains that are better on plants that the search did not see.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string source = UPRIGHT_SOURCE_DIR;

class OptimiseCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("upright-optimise-command-" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string in_folder(const std::string& name) const { return (folder_ / name).string(); }

  std::string sweep(const std::string& gains, const std::string& uncertainty) const {
    const std::string file = in_folder("sweep.yaml");
    std::ofstream(file)
        << "sweep:\n  plant: " << source << "/config/plants/exponential.yaml\n  gains: " << gains
        << "\n  loop: sampled\n  rig: " << source
        << "/config/rigs/simulated.yaml\n  theta0_deg: [1, 2, 3, 4]\n  delay_s: [0.02, 0.03]\n"
        << "  duration_s: 3\n  outcome: {stable_below_rad: 0.0016, fell_above_rad: 1.0}\n"
        << "  engine: fast\n"
        << uncertainty;
    return file;
  }

  /// Falls by the sweep over plants of another seed.
  double share_that_falls(const std::string& gains) const {
    const std::string file = sweep(gains, "  uncertainty: {percent: 5, samples: 60, seed: 77}\n");
    const CommandResult result = run_upright("sweep " + file + " --overwrite --out " + in_folder("map"));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::ifstream rows(folder_ / "map" / "uncertainty.csv");
    std::string row;
    std::getline(rows, row);
    double sum = 0.0;
    int points = 0;
    for (; std::getline(rows, row); ++points) {
      std::istringstream cells(row);
      std::string cell;
      for (int i = 0; i < 4; ++i) std::getline(cells, cell, ',');
      sum += std::stod(cell);
    }
    EXPECT_EQ(points, 8);
    return sum / points;
  }

  fs::path folder_;
};

TEST_F(OptimiseCommand, WritesGainsThatFallLessOnOtherPlants) {
  const std::string start = source + "/config/gains/exponential.yaml", better = in_folder("better.yaml");
  const std::string file = sweep(start, "  uncertainty: {percent: 5, samples: 8, seed: 1}\n");
  const CommandResult result = run_upright("optimise " + file + " --evaluations 30 --json --out " + better);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json found = Json::parse(result.out);
  EXPECT_EQ(found.at("better"), true);
  const Json& fresh = found.at("fresh_plants");
  EXPECT_LT(fresh.at("after").at("cost"), fresh.at("before").at("cost"));
  EXPECT_NEAR(fresh.at("gained").get<double>(),
              fresh.at("before").at("cost").get<double>() - fresh.at("after").at("cost").get<double>(),
              1e-12);
  EXPECT_EQ(found.at("margins").at("before").size(), 2u);
  EXPECT_EQ(found.at("written_to"), better);

  EXPECT_EQ(run_upright("check " + better).exit_code, 0);
  EXPECT_EQ(run_upright("margin " + source + "/config/plants/exponential.yaml " + better).exit_code, 0);
  const CommandResult run =
      run_upright("run --rig " + source + "/config/rigs/simulated.yaml --gains " + better +
                  " --fast --theta0-deg 3 --duration 5 --out " + in_folder("runs"));
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_LT(share_that_falls(better), share_that_falls(start) - 0.1);

  const CommandResult again = run_upright("optimise " + file + " --out " + better);
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("--force"), std::string::npos) << again.err;
}

TEST_F(OptimiseCommand, WritesNothingThatIsNotBetter) {
  const std::string start = source + "/config/gains/exponential.yaml", out = in_folder("none.yaml");
  // Without any cost nothing is better than the start.
  const std::string options = "optimise " +
                              sweep(start, "  uncertainty: {percent: 5, samples: 2, seed: 1}\n") +
                              " --fall-cost 0 --cart-cost 0 --angle-cost 0 --evaluations 10";
  const CommandResult refused = run_upright(options + " --out " + out);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("not better on fresh plants"), std::string::npos) << refused.err;
  EXPECT_FALSE(fs::exists(out));
  const CommandResult shown = run_upright(options + " --json");
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_EQ(Json::parse(shown.out).at("better"), false);
}

TEST_F(OptimiseCommand, NeedsASweepFileWithUncertainty) {
  const CommandResult result =
      run_upright("optimise " + sweep(source + "/config/gains/exponential.yaml", ""));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("add uncertainty"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace upright::testing
