// Whole runs over digital lines: on edges, and a rehearsal on a simulated rig. What the plant was given is
// what counts.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "balance.hpp"
#include "guest_run.hpp"
#include "line_wires.hpp"
#include "plant_on_wires.hpp"

namespace upright::test {
namespace {

TEST(GpioRun, BalancesOnEdges) {
  const GuestRun files(line_rig_text);
  LineWires wires;
  PlantOnWires plant(wires, line_rig_text, line_rig_start, files.trace());
  Process run(files.command(6.0));
  const std::string said = run.rest();
  EXPECT_EQ(run.wait(), 0) << said;
  EXPECT_TRUE(wires.at_rest());
  const int beats = wires.beats();
  EXPECT_GT(beats, 900) << "once per voltage, of 1200 periods on a slow machine";
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_EQ(wires.beats(), beats) << "the heart rests";
  const std::vector<TraceRow> rows = plant.record();
  EXPECT_GT(last_voltage_s(rows) - let_go_s(rows), 5.0);
  EXPECT_GT(worst_theta_rad(rows, 0.0), 0.01) << "it had something to do";
  EXPECT_LT(worst_theta_rad(rows, 3.0), 0.05) << said;
}

/// A simulated rig with real lines is a rehearsal.
TEST(GpioRehearsal, TheEmergencyStopEndsARunOfASimulatedRig) {
  GpioSim sim("rig", 8);
  sim.pull(LineNumbers::minus, true);
  const GuestRun files(simulated_rig_text());
  Process run(files.command(60.0, " --theta0-deg 0"));
  ASSERT_TRUE(wait_for_rows(files.runs()));
  EXPECT_TRUE(sim.level(LineNumbers::enable));
  sim.pull(LineNumbers::stop, true);
  const std::string said = run.rest();
  EXPECT_EQ(run.wait(), 3) << said;
  EXPECT_NE(said.find("the emergency stop was pressed"), std::string::npos) << said;
  EXPECT_FALSE(sim.level(LineNumbers::enable));
}

std::string doctor_of(const GuestRun& files) {
  Process doctor(quiet("doctor --seconds 0.3 --rate 100 --rig " + files.rig_file().string()));
  return doctor.rest();
}

TEST(GpioRehearsal, TheDoctorLooksAtTheLinesOfASimulatedRig) {
  GpioSim sim("rig", 8);
  sim.pull(LineNumbers::minus, true);
  const GuestRun files(simulated_rig_text());
  const std::string at_rest = doctor_of(files);
  for (const char* part :
       {"digital lines: read ", "emergency stop: wired, not pressed", "limit switches: 2 wired, none tripped",
        "amplifier enable: line 3 of rig is reserved", "heartbeat: line 4 of rig is reserved"})
    EXPECT_NE(at_rest.find(part), std::string::npos) << part << "\n" << at_rest;
  sim.pull(LineNumbers::stop, true);
  const std::string pressed = doctor_of(files);
  EXPECT_NE(pressed.find("emergency stop: it is pressed"), std::string::npos) << pressed;
  EXPECT_FALSE(sim.level(LineNumbers::enable));
}

}  // namespace
}  // namespace upright::test
