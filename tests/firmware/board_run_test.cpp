// `upright run` balances a plant behind the emulated board, through the modbus-rtu backend, in real time.
#include <gtest/gtest.h>

#include <cmath>

#include "../fault/evidence.hpp"
#include "board_setting.hpp"
#include "upright/record/run_reader.hpp"

namespace upright::test {
namespace {

TEST(BoardRun, Balances) {
  BoardSetting setting;
  Process controller(setting.command(5.0));
  const std::string said = controller.rest();
  ASSERT_EQ(controller.wait(), 0) << said;
  const std::vector<TraceRow> trace = setting.board().record();
  const RunRecord run = read_run(only_entry(setting.runs()));
  ASSERT_TRUE(run.outcome.has_value());
  EXPECT_EQ(run.outcome->text("reason"), "duration");
  ASSERT_FALSE(trace.empty());
  const double end_s = log_end_s(only_entry(setting.runs()));
  for (const TraceRow& row : trace) {
    if (row.time_s < end_s - 2.0 || row.time_s > end_s) continue;
    EXPECT_LT(std::abs(row.theta_rad), 0.05);
    EXPECT_LT(std::abs(row.cart_m), 0.1);
  }
  EXPECT_EQ(trace.back().voltage_v, 0.0);
  EXPECT_TRUE(setting.board().at_rest());
}

}  // namespace
}  // namespace upright::test
