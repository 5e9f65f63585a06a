#include "lane_predictions.hpp"

#include "control/estimate_predictor.hpp"
#include "control/kalman_filter.hpp"
#include "control/predictor.hpp"

namespace upright {

const FeedbackPrediction& LanePredictions::at(double delay_s) {
  const auto known = made_.find(delay_s);
  if (known != made_.end()) return known->second;
  ControlConfig control = setup_.control;
  control.delay_s = delay_s;
  const ModelParts parts = setup_.make_parts(control);
  if (const auto* predictor = dynamic_cast<const Predictor*>(parts.compensator.get())) {
    plant_ = predictor->model();
    return made_.emplace(delay_s, predictor->feedback(control.gains)).first->second;
  }
  const auto& predictor = dynamic_cast<const EstimatePredictor&>(*parts.compensator);
  const auto& filter = dynamic_cast<const KalmanFilter&>(*parts.estimator);
  plant_ = predictor.model();
  return made_.emplace(delay_s, predictor.feedback(control.gains, filter.step().rejecting_v_per_n))
      .first->second;
}

}  // namespace upright
