// `upright design` and `upright margin` as a user meets them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "command.hpp"

namespace upright::testing {
namespace {

using Json = nlohmann::json;

const std::string config_folder = std::string(UPRIGHT_SOURCE_DIR) + "/config/";

std::string plant(const std::string& name) {
  return shell_quoted(config_folder + "plants/" + name + ".yaml");
}

std::string gains(const std::string& name) {
  return shell_quoted(config_folder + "gains/" + name + ".yaml");
}

Json json_from(const std::string& arguments) {
  const CommandResult result = run_upright(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return Json::parse(result.out);
}

TEST(Design, GivesThePapersGainsAndExplainsWhatItEliminated) {
  const Json exponential = json_from("design " + plant("exponential") + " --q 5000,3000,20,20 --r 1 --json");
  const std::array<double, 4> paper = {70.7107, 304.9273, 143.3152, 61.0833};  // (7) as printed
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(exponential["gains"][i].get<double>(), paper[i], 1e-5 * paper[i]);
  EXPECT_TRUE(exponential["eliminated_states"].empty());
  EXPECT_EQ(exponential["closed_loop_poles"].size(), 4u);
  for (const Json& pole : exponential["closed_loop_poles"]) EXPECT_LT(pole[0].get<double>(), 0.0);

  const Json dynamic = json_from("design " + plant("dynamic") + " --q 5000,3000,20,20 --r 1 --json");
  const std::array<double, 4> whole = {170.170, 290.499, 136.020, 58.101};
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(dynamic["gains"][i].get<double>(), whole[i], 1e-5 * whole[i]);
  EXPECT_NE(dynamic["eliminated_states"].dump().find("85.08"), std::string::npos);
}

TEST(Design, ForADelaySolvesWithDelayLineAndVelocityFilterAsStates) {
  for (const char* delay : {"0", "0.0205", "0.1"}) {
    const Json design = json_from("design " + plant("viscous") + " --delay " + delay + " --json");
    EXPECT_LT(design["sampled"]["delay_line_residual"].get<double>(), 1e-9) << delay;
    EXPECT_LT(design["sampled"]["delay_line_difference"].get<double>(), 1e-6) << delay;
    EXPECT_LT(design["riccati_residual"].get<double>(), 1e-9) << delay;
  }
}

TEST(Design, AGainFileForADelayHoldsThePendulumAtThatDelay) {
  const TemporaryFolder folder;
  const std::string out = (folder.path() / "late.yaml").string();
  ASSERT_EQ(run_upright("design " + plant("viscous") + " --delay 0.12 --out " + shell_quoted(out)).exit_code,
            0);
  const Json margin = json_from("margin " + plant("viscous") + " " + shell_quoted(out) + " --json");
  EXPECT_GT(margin["sampled"]["critical_delay_s"].get<double>(), 0.12);
  const CommandResult run = run_upright(
      "run --rig " + shell_quoted(config_folder + "rigs/simulated.yaml") + " --gains " + shell_quoted(out) +
      " --fast --theta0-deg 3 --duration 20 --out " + shell_quoted(folder.path().string()) + " --json");
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

TEST(Design, WritesAGainFileThatReadsBack) {
  const TemporaryFolder folder;
  const std::string out = (folder.path() / "compensated.yaml").string();
  const std::string line =
      "design " + plant("viscous") + " --delay 0.1 --rate 500 --out " + shell_quoted(out);
  const CommandResult first = run_upright(line);
  EXPECT_EQ(first.exit_code, 0) << first.err;
  EXPECT_NE(read_text(out).find("kind: predictor"), std::string::npos);
  EXPECT_EQ(run_upright("check " + shell_quoted(out)).exit_code, 0);
  EXPECT_EQ(run_upright("margin " + plant("viscous") + " " + shell_quoted(out)).exit_code, 0);

  const CommandResult again = run_upright(line);
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("--force"), std::string::npos);
  EXPECT_EQ(run_upright(line + " --force").exit_code, 0);
}

TEST(Design, BadInputNamesTheMatrixOrTheFlag) {
  const CommandResult weights = run_upright("design " + plant("viscous") + " --q 0,0,0,0");
  EXPECT_EQ(weights.exit_code, 2);
  EXPECT_NE(weights.err.find("Q = ["), std::string::npos) << weights.err;
  for (const std::string flags : {"--q 1,2,3", "--q 1,2,3,-4", "--q 1,2,3,nan", "--r 0", "--r x",
                                  "--smoothing 0", "--delay -1", "--rate 0", "--out /nowhere/gains.yaml"}) {
    const CommandResult result = run_upright("design " + plant("viscous") + " " + flags);
    EXPECT_EQ(result.exit_code, 2) << flags;
    EXPECT_EQ(result.out, "") << flags;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
}

TEST(Margin, GivesThePapersCriticalDelays) {
  const Json exponential =
      json_from("margin " + plant("exponential") + " " + gains("exponential") + " --json");
  EXPECT_NEAR(exponential["critical_delay_s"].get<double>(), 0.10690, 5e-6);
  EXPECT_NEAR(exponential["crossing_radps"].get<double>(), 10.230, 5e-4);
  EXPECT_TRUE(exponential["roots"]["confirmed"].get<bool>());
  EXPECT_TRUE(exponential["sampled"]["roots"]["confirmed"].get<bool>());
  EXPECT_GE(exponential["sampled"]["crossings"].size(), 1u);
  const Json viscous = json_from("margin " + plant("viscous") + " " + gains("exponential") + " --json");
  EXPECT_NEAR(viscous["critical_delay_s"].get<double>(), 0.01536, 5e-6);
  const Json dynamic = json_from("margin " + plant("dynamic") + " " + gains("dynamic") + " --json");
  EXPECT_NEAR(dynamic["critical_delay_s"].get<double>(), 0.1072, 5e-5);
  EXPECT_TRUE(dynamic["roots"]["confirmed"].get<bool>());
}

TEST(Margin, VerdictComesFirst) {
  const CommandResult plain = run_upright("margin " + plant("exponential") + " " + gains("exponential"));
  EXPECT_EQ(plain.out.find("Verdict: on the rig the loop tolerates 14.2 ms"), 0u) << plain.out;
  const Json document = json_from("margin " + plant("exponential") + " " + gains("exponential") + " --json");
  EXPECT_NEAR(document["verdict"]["bears_delay_s"].get<double>(), 0.01415, 5e-5);
  EXPECT_EQ(document["verdict"]["bears_delay_s"], document["sampled_sliding"]["critical_delay_s"]);
}

TEST(Margin, OfAPredictorDoesNotContradictItsVerdict) {
  const CommandResult late = run_upright("margin " + plant("exponential") + " " + gains("compensated"));
  EXPECT_EQ(late.out.find("Verdict: on the rig the loop tolerates 121 ms"), 0u) << late.out;
  EXPECT_EQ(late.out.find("continuous loop\n"), std::string::npos) << "of what, it must say";
  EXPECT_NE(late.out.find("without the predictor"), std::string::npos) << late.out;
  EXPECT_NE(late.out.find("it shows stick-slip"), std::string::npos) << late.out;
  const std::string sampled = late.out.substr(0, late.out.find("continuous loop"));
  EXPECT_EQ(sampled.find("without any delay"), std::string::npos) << late.out;
}

TEST(Margin, OfALoopThatIsBeyondItSaysSoFirst) {
  const TemporaryFolder folder;
  std::string text = read_text(config_folder + "gains/exponential.yaml");
  text.replace(text.find("delay_s: 0.0"), 12, "delay_s: 0.05");
  const std::string late = shell_quoted(folder.write("late.yaml", text).string());
  EXPECT_EQ(run_upright("margin " + plant("exponential") + " " + late).out.find("Verdict: THE LOOP WILL"),
            0u);
  EXPECT_EQ(json_from("margin " + plant("exponential") + " " + late + " --json")["verdict"]["will_hold"],
            false);
}

TEST(Margin, OfTheDynamicModelWithTheWholeGainOnTheCart) {
  const TemporaryFolder folder;
  const std::string whole = (folder.path() / "whole.yaml").string();
  ASSERT_EQ(run_upright("design " + plant("dynamic") + " --out " + shell_quoted(whole)).exit_code, 0);
  const Json margin = json_from("margin " + plant("dynamic") + " " + shell_quoted(whole) + " --json");
  EXPECT_NEAR(margin["critical_delay_s"].get<double>(), 0.1160, 5e-5);
  EXPECT_NEAR(margin["crossing_radps"].get<double>(), 9.633, 1e-3);
  EXPECT_TRUE(margin["roots"]["confirmed"].get<bool>());
  EXPECT_LT(margin["roots"]["below"]["rightmost_root"][0].get<double>(), 0.0);
  EXPECT_GT(margin["roots"]["above"]["rightmost_root"][0].get<double>(), 0.0);
}

TEST(Margin, OfTheViscousGainOnItsOwnModel) {
  const TemporaryFolder folder;
  const std::string own = (folder.path() / "viscous.yaml").string();
  const Json design = json_from("design " + plant("viscous") + " --out " + shell_quoted(own) + " --json");
  const std::array<double, 4> known = {70.7107, 143.2162, 51.3919, 27.1288};
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(design["gains"][i].get<double>(), known[i], 1e-5 * known[i]);
  const Json margin = json_from("margin " + plant("viscous") + " " + shell_quoted(own) + " --json");
  EXPECT_NEAR(margin["critical_delay_s"].get<double>(), 0.0459, 5e-5);
}

std::string run_line(const std::string& gain_file, const TemporaryFolder& folder, const std::string& flags) {
  return "run --rig " + shell_quoted(config_folder + "rigs/simulated.yaml") + " --gains " + gains(gain_file) +
         " --fast --theta0-deg 3 --out " + shell_quoted(folder.path().string()) + " " + flags;
}

TEST(Run, StaysUpLateWithThePredictorAndReplaysBitForBitAnywhere) {
  const TemporaryFolder folder;
  const CommandResult late =
      run_upright(run_line("compensated", folder, "--duration 20 --delay 0.15 --json"));
  ASSERT_EQ(late.exit_code, 0) << late.err;
  const Json document = Json::parse(late.out);
  EXPECT_TRUE(document["stayed_up"].get<bool>());
  EXPECT_GT(document["delay_margin"]["extra_delay_s"].get<double>(), 0.0);
  const std::filesystem::path run(document["run_directory"].get<std::string>());
  const std::filesystem::path moved = folder.path() / "elsewhere" / "run";
  std::filesystem::create_directories(moved.parent_path());
  std::filesystem::rename(run, moved);
  const CommandResult replayed = run_upright("replay " + shell_quoted(moved.string()));
  EXPECT_EQ(replayed.exit_code, 0) << replayed.out << replayed.err;
  EXPECT_NE(replayed.out.find("bit for bit"), std::string::npos);
  EXPECT_EQ(run_upright(run_line("exponential", folder, "--duration 20 --delay 0.15")).exit_code, 3);
}

TEST(Design, MakesAnExtendedKalmanFilterThatReplaysBitForBit) {
  const TemporaryFolder folder;
  const std::string made = (folder.path() / "quieter.yaml").string();
  const Json design = json_from("design " + plant("exponential") + " --estimator extended_kalman --out " +
                                shell_quoted(made) + " --json");
  EXPECT_EQ(design["trials"]["fell"].get<int>(), 0);
  EXPECT_LT(design["trials"]["hunting_m"].get<double>(), 0.003);
  const Json margin = json_from("margin " + plant("exponential") + " " + shell_quoted(made) + " --json");
  EXPECT_GE(margin["sampled_sliding_unmodelled"]["critical_delay_s"].get<double>(), 0.005);
  EXPECT_EQ(margin["notes"].size(), 1u);
  const CommandResult run = run_upright(
      "run --rig " + shell_quoted(config_folder + "rigs/simulated.yaml") + " --gains " + shell_quoted(made) +
      " --fast --theta0-deg 3 --duration 10 --json --out " + shell_quoted(folder.path().string()));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto directory = Json::parse(run.out)["run_directory"].get<std::string>();
  const CommandResult replayed = run_upright("replay " + shell_quoted(directory));
  EXPECT_EQ(replayed.exit_code, 0) << replayed.out << replayed.err;
  EXPECT_NE(replayed.out.find("bit for bit"), std::string::npos);
}

TEST(Design, ForADelayWithoutAPredictorTheMarginGrows) {
  const TemporaryFolder folder;
  const std::string made = (folder.path() / "slow-link.yaml").string();
  const Json design = json_from("design " + plant("viscous") + " --estimator kalman --for-delay 0.03 --out " +
                                shell_quoted(made) + " --json");
  const Json& margin = design["margin"];
  EXPECT_LE(margin["cost_loss"].get<double>(), 0.3);
  EXPECT_GT(margin["critical_delay_s"].get<double>(), 1.3 * margin["lqr_critical_delay_s"].get<double>());
  EXPECT_EQ(design["trials"]["fell"].get<int>(), 0);
  const Json judged = json_from("margin " + plant("viscous") + " " + shell_quoted(made) + " --json");
  EXPECT_NEAR(judged["sampled_sliding"]["critical_delay_s"].get<double>(),
              margin["critical_delay_s"].get<double>(), 1e-6);
  EXPECT_NEAR(judged["sampled_sliding_unmodelled"]["critical_delay_s"].get<double>(),
              0.03 + design["estimator"]["bears_unmodelled_delay_s"].get<double>(), 1e-6);
  const CommandResult run = run_upright(
      "run --rig " + shell_quoted(config_folder + "rigs/simulated.yaml") + " --gains " + shell_quoted(made) +
      " --fast --theta0-deg 3 --duration 20 --out " + shell_quoted(folder.path().string()));
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
}

TEST(Design, RefusesFlagsOfADelayThatContradictEachOther) {
  const auto error_of = [](const std::string& flags) {
    const CommandResult result = run_upright("design " + plant("viscous") + " " + flags);
    EXPECT_EQ(result.exit_code, 2) << flags;
    return result.err;
  };
  EXPECT_NE(error_of("--for-delay 0.02 --delay 0.02").find("give one of the two"), std::string::npos);
  EXPECT_NE(error_of("--cost-loss 0.2").find("add --for-delay"), std::string::npos);
  EXPECT_NE(error_of("--for-delay 0.2").find("raise --cost-loss"), std::string::npos);
}

TEST(Run, SaysAtItsStartWhatTheGainsTolerate) {
  const TemporaryFolder folder;
  const CommandResult run = run_upright(run_line("exponential", folder, "--duration 1"));
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::size_t margin = run.out.find("Delay margin: ");
  ASSERT_NE(margin, std::string::npos) << run.out;
  EXPECT_LT(margin, run.out.find("Stayed up")) << run.out;  // at the start, before what came of it
  EXPECT_NE(run.out.find("14 consecutive missed periods"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("more than 14 periods in a row"), std::string::npos) << run.out;
}

TEST(Margin, MissingFilesAndPlantsWithoutPendulumAreRefused) {
  EXPECT_EQ(run_upright("margin /nowhere.yaml " + gains("viscous")).exit_code, 2);
  EXPECT_EQ(run_upright("margin " + plant("viscous") + " /nowhere.yaml").exit_code, 2);
  const TemporaryFolder folder;
  const std::string cart =
      folder
          .write("cart.yaml",
                 "plant:\n  cart_mass_kg: 0.8\n  gravity_mps2: 9.8\n"
                 "  motor: {force_per_volt_n: 1.7, back_emf_n_per_mps: 7.7}\n  effects: []\n")
          .string();
  const CommandResult result = run_upright("margin " + shell_quoted(cart) + " " + gains("viscous"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("pendulum"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace upright::testing
