// The predictors of loops with different delays, each made once.
#pragma once

#include <map>

#include "control/predictor_step.hpp"
#include "loop_run.hpp"

namespace upright {

class LanePredictions {
 public:
  /// Of a setup with a compensator.
  explicit LanePredictions(const LoopSetup& setup) : setup_(setup) {}

  /// For this delay. Throws ConfigError where it cannot be made.
  const FeedbackPrediction& at(double delay_s);
  /// The plant that all of them predict. Known once there is one.
  const PlantModel<double>& plant() const { return plant_; }

 private:
  const LoopSetup& setup_;
  PlantModel<double> plant_;
  std::map<double, FeedbackPrediction> made_;  ///< by delay
};

}  // namespace upright
