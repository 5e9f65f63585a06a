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

double fastest_rate_radps(const PlantModel<double>& model) {
  const Dynamics<double> physics(model);
  double fastest = 0.0;
  for (const double speed : {0.0, 0.01, 0.1, 1.0}) {
    PlantState<double> state;
    state.cart_mps = speed;
    fastest = std::max(fastest, physics.fastest_rate_radps(state));
  }
  return fastest;
}

}  // namespace upright
