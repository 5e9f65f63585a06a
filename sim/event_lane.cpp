#include "event_lane.hpp"

#include "upright/sim/event_engine.hpp"

namespace upright {

class EventLane::Work {
 public:
  explicit Work(const PlantModel<double>& model) : engine(model) {}
  EventEngine<double> engine;
};

EventLane::EventLane(const PlantModel<double>& model) : work_(std::make_unique<Work>(model)) {}
EventLane::~EventLane() = default;

void EventLane::advance(PlantState<double>& state, double voltage_v, double duration_s) {
  work_->engine.start(state, 0.0, voltage_v);
  work_->engine.advance(duration_s, voltage_v);
  state = work_->engine.state();
}

}  // namespace upright
