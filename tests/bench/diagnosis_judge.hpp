// What the data of a case can show, by fits that begin at the truth; and what a diagnosis of them is worth.
//
// - visible: the true structure saves at least 25 of minus twice the log likelihood on all runs, compared
//   with the plant file with its own numbers refitted. Of effects that the registry lacks: the runs are at
//   least 20 percent further off (plain simulation) than the same runs without it.
// - distinguishable: the effect is not the same force as the one named (docs/reference/effects.md), and the
//   structure that was named instead fits worse than the true one by 16 or more.
// - clearly visible (laboratory): visible, and what is saved is at least `clear_factor` times what the same
//   structure saves on the same runs of a rig without the effect. There it can only fit what is unmodelled,
//   which the likelihood takes for white.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "blind_case.hpp"
#include "estimation/fit.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright::blind {

inline constexpr double clear_factor = 4.0;

/// The fits that later judgements of the same data compare with.
struct DataJudgement {
  FitResult base, truth;
};

/// Writes what the data can show into the record of a case.
DataJudgement judge_data(const Case& blind, const std::vector<Measurement>& runs, nlohmann::json& record);

/// Writes whether the effect that was named first fits worse than the hidden one.
void judge_name(const Case& blind, const std::vector<Measurement>& runs, const DataJudgement& data,
                const Diagnosis& diagnosis, nlohmann::json& record);

/// Writes the errors of plain simulations with the plant file, the model found and the truth: on held-out
/// runs, and for laboratory cases on a run that the diagnosis did not get.
void judge_gap(const Case& blind, const std::vector<Measurement>& runs, const Diagnosis& diagnosis,
               nlohmann::json& record);

}  // namespace upright::blind
