// `upright run` balances a plant behind the emulated board, through the modbus-rtu backend, in real time.
#include <gtest/gtest.h>

#include <cmath>

#include "../fault/evidence.hpp"
#include "board_setting.hpp"
#include "tests/support/run_end.hpp"
#include "upright/record/run_reader.hpp"

namespace upright::test {
namespace {

void balance(LoopClock clock) {
  BoardSetting setting({}, {}, clock);
  Process controller(setting.command(5.0));
  const std::string said = controller.rest();
  const int exit_code = controller.wait();
  const std::filesystem::path directory = only_entry(setting.runs());
  EXPECT_END(run_end(text_of(directory / "run.yaml")).value(), exit_code == 0);
  const std::vector<TraceRow> trace = setting.board().record();
  EXPECT_EQ(read_run(directory).outcome->text("reason"), "duration") << said;
  ASSERT_FALSE(trace.empty());
  const double end_s = log_end_s(directory);
  for (const TraceRow& row : trace) {
    if (row.time_s < end_s - 2.0 || row.time_s > end_s) continue;
    EXPECT_LT(std::abs(row.theta_rad), 0.05);
    EXPECT_LT(std::abs(row.cart_m), 0.1);
  }
  EXPECT_EQ(trace.back().voltage_v, 0.0);
  EXPECT_TRUE(setting.board().at_rest());
  const std::optional<YamlMap> timing = read_run(directory).outcome->optional_map("device_clock");
  EXPECT_EQ(timing.has_value(), clock == LoopClock::board);
}

TEST(BoardRun, Balances) {
  in_real_time([] { balance(LoopClock::computer); });
}

TEST(BoardRun, BalancesOnTheBoardsClock) {
  in_real_time([] { balance(LoopClock::board); });
}

}  // namespace
}  // namespace upright::test
