#include "upright/control/model_parts.hpp"

#include "estimate_predictor.hpp"
#include "extended_kalman_filter.hpp"
#include "kalman_filter.hpp"
#include "predictor.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

ModelParts make_model_parts(const ControlConfig& config, const Plant& estimated, const Plant& predicted) {
  ModelParts parts;
  if (config.state_estimator.kind == StateEstimatorKind::kalman)
    parts.estimator = std::make_unique<KalmanFilter>(config, estimated);
  if (config.state_estimator.kind == StateEstimatorKind::extended_kalman)
    parts.estimator = std::make_unique<ExtendedKalmanFilter>(config, estimated);
  if (config.compensation.kind == CompensationKind::none) return parts;
  if (config.has_state_estimator())
    parts.compensator = std::make_unique<EstimatePredictor>(config, predicted);
  else
    parts.compensator = std::make_unique<Predictor>(config, predicted);
  return parts;
}

ModelParts make_model_parts(const ControlConfig& config) {
  const bool predicts = config.compensation.kind == CompensationKind::predictor;
  return make_model_parts(
      config, config.has_state_estimator() ? read_plant_file(config.state_estimator.plant) : Plant{},
      predicts ? read_plant_file(config.compensation.plant) : Plant{});
}

}  // namespace upright
