// `upright simulate` as a user runs it.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";

class SimulateCommand : public ::testing::Test {
 protected:
  /// A run of the simulated rig with an own plant file, in virtual time.
  fs::path run(const std::string& plant, const std::string& flags) const {
    std::string rig = read_text(config + "rigs/simulated.yaml");
    const std::size_t at = rig.find("../plants/");
    EXPECT_NE(at, std::string::npos);
    rig.replace(at, rig.find('\n', at) - at, config + "plants/" + plant + ".yaml");
    const CommandResult result =
        run_upright("run --fast --rig " + folder_.write("rig.yaml", rig).string() + " --gains " + config +
                    "gains/" + plant + ".yaml " + flags + " --out " + folder_.path().string());
    const std::size_t end = result.out.find_last_not_of('\n');
    const std::size_t begin = result.out.rfind('\n', end) + 1;
    return result.out.substr(begin, end + 1 - begin);
  }

  Json simulated(const std::string& plant, const std::string& flags) const {
    const CommandResult result =
        run_upright("simulate " + config + "plants/" + plant + ".yaml " + flags + " --json");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out);
  }

  TemporaryFolder folder_;
};

TEST_F(SimulateCommand, SaysTheErrorOfEachRunInJson) {
  const fs::path a = run("viscous", "--duration 3 --theta0-deg 3"),
                 b = run("exponential", "--duration 2 --theta0-deg 2");
  const Json document = simulated("viscous", "--horizon 0.3 --data " + a.string() + " " + b.string());
  ASSERT_EQ(document.at("runs").size(), 2u);
  const Json &own = document.at("runs")[0], &other = document.at("runs")[1];
  EXPECT_EQ(own.at("file"), a.string());
  EXPECT_EQ(own.at("samples"), 3000);
  EXPECT_EQ(own.at("pieces"), 10);
  // Of the plant that made the data only the encoders' steps remain: those of the first 20 samples grow, as
  // an upright pendulum falls.
  EXPECT_LT(own.at("cart_rmse_m").get<double>(), 1e-4);
  EXPECT_LT(own.at("theta_rmse_rad").get<double>(), 2e-2);
  EXPECT_GT(other.at("cart_rmse_m").get<double>(), 10.0 * own.at("cart_rmse_m").get<double>());
}

TEST_F(SimulateCommand, SaysThatAnUprightPendulumFallsInOpenLoop) {
  const fs::path a = run("viscous", "--duration 5 --theta0-deg 3");
  const CommandResult words = run_upright("simulate " + config + "plants/viscous.yaml --data " + a.string());
  EXPECT_EQ(words.exit_code, 0) << words.err;
  EXPECT_EQ(words.out.rfind(a.string() + ": 5000 samples in 1 piece\n  cart      RMS error ", 0), 0u)
      << words.out;
  EXPECT_NE(words.out.find("has fallen in the simulation, since nothing balances it"), std::string::npos)
      << words.out;
}

TEST_F(SimulateCommand, OfTheClosedLoopBalancesAsTheRunDid) {
  const fs::path a = run("viscous", "--duration 5 --theta0-deg 3");
  const Json document =
      simulated("viscous", "--closed-loop " + config + "gains/viscous.yaml --data " + a.string());
  const Json& one = document.at("runs")[0];
  EXPECT_EQ(one.at("samples"), 5000);
  // The cart's way is some centimetres, and the loop forgets how it began.
  EXPECT_LT(one.at("cart_rmse_m").get<double>(), 1e-3);
  EXPECT_LT(one.at("theta_rmse_rad").get<double>(), 4e-3);
  EXPECT_LT(one.at("cart_percent").get<double>(), 5.0);
}

TEST_F(SimulateCommand, WritesCurvesAndAPage) {
  const fs::path a = run("viscous", "--duration 2 --theta0-deg 3"), out = folder_.path() / "out";
  const Json document = simulated("viscous", "--horizon 0.5 --data " + a.string() + " --out " + out.string());
  EXPECT_EQ(Json::parse(read_text(out / "simulation.json")), document);
  const std::string curves = read_text(out / "simulated.csv");
  EXPECT_EQ(std::count(curves.begin(), curves.end(), '\n'), 2001);
  EXPECT_EQ(curves.rfind("file,piece,time_s,voltage_v,simulated_voltage_v,cart_m,simulated_cart_m,", 0), 0u);
  const std::string page = read_text(out / "report.html");
  for (const char* text : {"RMS error: cart position ", "simulated minus measured", "<svg"})
    EXPECT_NE(page.find(text), std::string::npos) << text;
  EXPECT_EQ(page.find("<script"), std::string::npos);
  const CommandResult again = run_upright("simulate " + config + "plants/viscous.yaml --data " + a.string() +
                                          " --out " + out.string());
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("already holds a simulation"), std::string::npos) << again.err;
}

TEST_F(SimulateCommand, ReadsACartAloneAndLeavesTheAngleEmpty) {
  std::string rows = "time_s,voltage_v,cart_m\n";
  for (int k = 0; k <= 500; ++k)
    rows += std::to_string(0.002 * k) + ",0," + std::to_string(0.1 + 0.4 * 0.002 * k) + "\n";
  const fs::path data = folder_.write("cart.csv", rows);
  const fs::path plant =
      folder_.write("cart.yaml",
                    "plant: {cart_mass_kg: 1, gravity_mps2: 9.81, motor: {force_per_volt_n: "
                    "1, back_emf_n_per_mps: 0}, effects: []}\n");
  const CommandResult result =
      run_upright("simulate " + plant.string() + " --data " + data.string() + " --json");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const Json one = Json::parse(result.out).at("runs")[0];
  EXPECT_LT(one.at("cart_rmse_m").get<double>(), 1e-6);
  EXPECT_TRUE(one.at("theta_rmse_rad").is_null());
}

TEST_F(SimulateCommand, RefusesWhatMakesNoSense) {
  const fs::path a = run("viscous", "--duration 1 --theta0-deg 3");
  const std::string begin = "simulate " + config + "plants/viscous.yaml --data " + a.string();
  for (const char* flags : {"--horizon 0", "--horizon some", "--horizon -1", "--horizon 0.005", "--from 20",
                            "--initial-samples 1", "--closed-loop none.yaml"}) {
    const CommandResult result = run_upright(begin + " " + flags);
    EXPECT_EQ(result.exit_code, 2) << flags;
    EXPECT_FALSE(result.err.empty());
    EXPECT_TRUE(result.out.empty()) << result.out;
  }
}

}  // namespace
}  // namespace upright::testing
