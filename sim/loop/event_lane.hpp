// The event engine for one lane and one period, behind a wall: the vector engine is compiled with contracted
// multiply-adds, and must not leave copies of the scalar code that are compiled so.
#pragma once

#include <memory>

#include "upright/model/dynamics.hpp"

namespace upright {

class EventLane {
 public:
  explicit EventLane(const PlantModel<double>& model);
  ~EventLane();
  EventLane(const EventLane&) = delete;
  EventLane& operator=(const EventLane&) = delete;

  /// Moves `state` on by `duration_s` under the command `voltage_v`, through whatever events there are.
  void advance(PlantState<double>& state, double voltage_v, double duration_s);

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

/// The fastest rate of a plant's motion at any speed it is likely to have [1/s].
double fastest_rate_radps(const PlantModel<double>& model);

}  // namespace upright
