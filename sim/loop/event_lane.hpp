// The event engine for one lane and one period, in a separate object file: the lanes are compiled with
// contracted multiply-adds, and must not leave such copies of the scalar code.
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

  /// Advances `state` by `duration_s` under the command `voltage_v`, through all events.
  void advance(PlantState<double>& state, double voltage_v, double duration_s);

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

/// The greatest rate of a plant's motion at realistic speeds [1/s].
double fastest_rate_radps(const PlantModel<double>& model);

}  // namespace upright
