// What the live page is told: framing of server-sent events, and frames made of rows.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "live/frame_maker.hpp"

namespace upright {
namespace {

using Json = nlohmann::json;

LiveScene scene() {
  LiveScene scene;
  scene.title = "test \"quoted\"\n<b>";
  scene.track_limit_m = 0.35;
  scene.period_s = 1e-3;
  return scene;
}

LogRecord row(std::uint64_t tick, double late_us = 20.0) {
  LogRecord r;
  r.tick = tick;
  r.time_ns = static_cast<std::int64_t>(tick) * 1'000'000;
  r.cart_m = 0.001 * static_cast<double>(tick);
  r.theta_rad = -0.1;
  r.voltage_v = 2.5;
  r.wake_late_ns = static_cast<std::int64_t>(late_us * 1e3);
  return r;
}

std::uint64_t sum(const Json& bins) {
  std::uint64_t total = 0;
  for (const Json& bin : bins) total += bin.get<std::uint64_t>();
  return total;
}

TEST(LiveEvents, AreOneNamedEventWithOneLineOfData) {
  EXPECT_EQ(event_text("frame", "{\"a\":1}"), "event: frame\ndata: {\"a\":1}\n\n");
  FrameMaker maker(scene());
  maker.say({LiveState::Kind::running, "two\nlines"});
  // Line ends inside would end the event early.
  for (const std::string& json : {maker.scene_json(), maker.frame_json(), maker.history_json()}) {
    EXPECT_EQ(json.find('\n'), std::string::npos);
    EXPECT_TRUE(Json::accept(json)) << json;
  }
  EXPECT_EQ(Json::parse(maker.scene_json()).at("title"), scene().title);
}

TEST(LiveFrames, EndAtZeroVoltsWhateverTheLastRowHeld) {
  FrameMaker lasted(scene()), stopped(scene());
  for (FrameMaker* maker : {&lasted, &stopped})
    for (std::uint64_t tick = 0; tick < 8; ++tick) maker->add(row(tick));
  LogRecord stop = row(8);
  stop.voltage_v = 0.0;
  stop.flags = row_flag::stale | row_flag::stopped;
  stopped.add(stop);
  stopped.rest();
  lasted.rest();
  for (FrameMaker* maker : {&lasted, &stopped}) {
    const Json frame = Json::parse(maker->frame_json());
    EXPECT_EQ(frame.at("voltage_v"), 0.0);
    EXPECT_EQ(frame.at("points").back().at(3), 0.0) << "of the curve too";
  }
  EXPECT_EQ(Json::parse(lasted.frame_json()).at("rows"), 8) << "no row was made up";
}

TEST(LiveFrames, HoldTheLatestRowAndAPointEveryFiveMilliseconds) {
  FrameMaker maker(scene());
  for (std::uint64_t tick = 0; tick < 100; ++tick) maker.add(row(tick));
  const Json frame = Json::parse(maker.frame_json());
  EXPECT_EQ(frame.at("rows"), 100);
  EXPECT_EQ(frame.at("missed"), 0);
  EXPECT_NEAR(frame.at("cart_m").get<double>(), 0.099, 1e-9);
  ASSERT_EQ(frame.at("points").size(), 20u);
  EXPECT_EQ(frame.at("points")[1], Json::parse("[0.005, 0.005, -0.1, 2.5]"));
  // What was sent is not sent again, but it is history.
  EXPECT_TRUE(Json::parse(maker.frame_json()).at("points").empty());
  EXPECT_EQ(Json::parse(maker.history_json()).at("points").size(), 20u);
}

TEST(LiveFrames, CountTheLatenessOfEveryRowInItsBin) {
  FrameMaker maker(scene());
  const double late_us[] = {0.0, 1.0, 1.5, 60.0, 9000.0, 20000.0};
  std::uint64_t tick = 0;
  for (const double late : late_us) maker.add(row(tick++, late));
  const Json late = Json::parse(maker.frame_json()).at("late");
  const Json& bins = late.at("bins");
  ASSERT_EQ(bins.size(), lateness_edges_us.size() + 1);
  EXPECT_EQ(sum(bins), 6u);
  EXPECT_EQ(bins[0], 2);  // up to and with 1 us
  EXPECT_EQ(bins[1], 1);
  EXPECT_EQ(bins[6], 1);  // 50 to 100 us
  EXPECT_EQ(bins[12], 1);
  EXPECT_EQ(bins[13], 1);  // beyond the last edge
  EXPECT_NEAR(late.at("worst_us").get<double>(), 20000.0, 1.0);
}

TEST(LiveFrames, CountPeriodsWithoutARowAndLostRows) {
  FrameMaker maker(scene());
  maker.add(row(0));
  maker.add(row(4));
  maker.note_unseen(7);
  const Json frame = Json::parse(maker.frame_json());
  EXPECT_EQ(frame.at("missed"), 3);
  EXPECT_EQ(frame.at("unseen"), 7);
}

TEST(LiveFrames, BeginAnewWithEachRun) {
  FrameMaker maker(scene());
  maker.add_pose(0.2, {0.01, 3.1});
  maker.add_pose(0.4, {0.01, 1.0});
  EXPECT_EQ(Json::parse(maker.history_json()).at("points").size(), 2u);
  EXPECT_EQ(Json::parse(maker.history_json()).at("run"), 0);
  for (std::uint64_t tick = 0; tick < 50; ++tick) maker.add(row(tick));
  const Json first = Json::parse(maker.frame_json());
  for (std::uint64_t tick = 0; tick < 10; ++tick) maker.add(row(tick));
  const Json second = Json::parse(maker.frame_json());
  EXPECT_EQ(first.at("run"), 1);
  EXPECT_EQ(first.at("points").size(), 10u);
  EXPECT_EQ(second.at("run"), 2);
  EXPECT_EQ(second.at("rows"), 10);
  EXPECT_EQ(sum(second.at("late").at("bins")), 10u);
  EXPECT_EQ(second.at("points").size(), 2u);
  EXPECT_EQ(Json::parse(maker.history_json()).at("points").size(), 2u);
}

TEST(LiveFrames, KeepNoMoreThanTheLastSeconds) {
  FrameMaker maker(scene());
  for (std::uint64_t tick = 0; tick < 60'000; ++tick) maker.add(row(tick));
  const Json points = Json::parse(maker.history_json()).at("points");
  EXPECT_LE(points.size(), static_cast<std::size_t>(FrameMaker::history_s / 5e-3) + 1);
  EXPECT_NEAR(points.front()[0].get<double>(), 60.0 - FrameMaker::history_s, 0.01);
}

TEST(LiveFrames, SayWhatIsNotANumberAsNull) {
  FrameMaker maker(scene());
  LogRecord bad = row(0);
  bad.theta_rad = std::numeric_limits<double>::quiet_NaN();
  bad.voltage_v = std::numeric_limits<double>::infinity();
  maker.add(bad);
  const Json frame = Json::parse(maker.frame_json());
  EXPECT_TRUE(frame.at("theta_rad").is_null());
  EXPECT_TRUE(frame.at("points")[0][3].is_null());
}

}  // namespace
}  // namespace upright
