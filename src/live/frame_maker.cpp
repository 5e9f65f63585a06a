#include "frame_maker.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

namespace upright {

namespace {

using Json = nlohmann::ordered_json;

constexpr double point_every_s = 5e-3;

/// A number with no more digits than a screen can show; null where it is not finite.
Json decimals(double value, int digits) {
  if (!std::isfinite(value)) return nullptr;
  const double scale = std::pow(10.0, digits);
  return std::round(value * scale) / scale;
}

const char* name_of(LiveState::Kind kind) {
  switch (kind) {
    case LiveState::Kind::waiting:
      return "waiting";
    case LiveState::Kind::running:
      return "running";
    case LiveState::Kind::completed:
      return "completed";
    case LiveState::Kind::stopped:
      return "stopped";
  }
  return "running";
}

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string event_text(const std::string& name, const std::string& json) {
  return "event: " + name + "\ndata: " + json + "\n\n";
}

FrameMaker::FrameMaker(const LiveScene& scene)
    : scene_(scene),
      every_(static_cast<std::uint64_t>(std::max(1.0, std::round(point_every_s / scene.period_s)))) {}

void FrameMaker::begin_run() {
  ++run_;
  rows_ = missed_ = unseen_ = next_point_tick_ = 0;
  late_ = {};
  bins_.fill(0);
  points_.clear();
  new_points_ = 0;
}

void FrameMaker::add(const LogRecord& row) {
  const bool begins = run_ == 0 || row.tick <= latest_.tick;
  if (begins)
    begin_run();
  else
    missed_ += row.tick - latest_.tick - 1;
  latest_ = row;
  ++rows_;
  late_.add(row.wake_late_ns);
  const double late_us = static_cast<double>(row.wake_late_ns) * 1e-3;
  const auto bin = std::lower_bound(lateness_edges_us.begin(), lateness_edges_us.end(), late_us);
  ++bins_[static_cast<std::size_t>(std::distance(lateness_edges_us.begin(), bin))];
  const bool stopped = (row.flags & row_flag::stopped) != 0;
  if (row.tick < next_point_tick_ && !stopped) return;
  next_point_tick_ = row.tick + every_;
  add_point({static_cast<double>(row.time_ns) * 1e-9, row.cart_m, row.theta_rad, row.voltage_v});
}

void FrameMaker::add_pose(double time_s, const Pose& pose) {
  if (run_ != 0) return;
  latest_.time_ns = static_cast<std::int64_t>(time_s * 1e9);
  latest_.cart_m = pose.cart_m;
  latest_.theta_rad = pose.theta_rad;
  add_point({time_s, pose.cart_m, pose.theta_rad, 0.0});
}

void FrameMaker::rest() {
  if (run_ == 0 || latest_.voltage_v == 0.0) return;
  latest_.voltage_v = 0.0;
  add_point({static_cast<double>(latest_.time_ns) * 1e-9, latest_.cart_m, latest_.theta_rad, 0.0});
}

void FrameMaker::add_point(const Point& point) {
  points_.push_back(point);
  ++new_points_;
  while (points_.front().time_s < point.time_s - history_s) points_.pop_front();
  new_points_ = std::min(new_points_, points_.size());
}

std::string FrameMaker::scene_json() const {
  return text_of(Json{{"title", scene_.title},
                      {"track_limit_m", scene_.track_limit_m},
                      {"voltage_limit_v", scene_.voltage_limit_v},
                      {"fall_angle_rad", scene_.fall_angle_rad},
                      {"period_s", scene_.period_s},
                      {"pendulum_m", scene_.pendulum_m},
                      {"lateness_edges_us", lateness_edges_us}});
}

std::string FrameMaker::json_from(std::size_t first_point) const {
  constexpr int microseconds = 6, micrometres = 6, microradians = 6, millivolts = 3, tenths = 1;
  Json points = Json::array();
  for (std::size_t i = first_point; i < points_.size(); ++i) {
    const Point& p = points_[i];
    points.push_back({decimals(p.time_s, microseconds), decimals(p.cart_m, micrometres),
                      decimals(p.theta_rad, microradians), decimals(p.voltage_v, millivolts)});
  }
  return text_of(Json{{"run", run_},
                      {"state", {{"kind", name_of(state_.kind)}, {"text", state_.text}}},
                      {"time_s", decimals(static_cast<double>(latest_.time_ns) * 1e-9, microseconds)},
                      {"cart_m", decimals(latest_.cart_m, micrometres)},
                      {"theta_rad", decimals(latest_.theta_rad, microradians)},
                      {"voltage_v", decimals(latest_.voltage_v, millivolts)},
                      {"late",
                       {{"bins", bins_},
                        {"p50_us", decimals(late_.quantile_us(0.5), tenths)},
                        {"p99_us", decimals(late_.quantile_us(0.99), tenths)},
                        {"worst_us", decimals(late_.max_us(), tenths)}}},
                      {"rows", rows_},
                      {"missed", missed_},
                      {"unseen", unseen_},
                      {"points", points}});
}

std::string FrameMaker::frame_json() {
  std::string json = json_from(points_.size() - new_points_);
  new_points_ = 0;
  return json;
}

std::string FrameMaker::history_json() const {
  return json_from(0);
}

}  // namespace upright
