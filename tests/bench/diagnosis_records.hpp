// Records of a diagnosis matrix: one line of JSON for each case, and what a line says of its case.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace upright::blind {

using Records = std::vector<nlohmann::json>;

/// Every whole line of files of JSON lines, each case once; a last line that was cut off is left out.
Records read_records(const std::vector<std::string>& files);

/// Names a case: its seed, number, condition and flags.
std::string key_of(const nlohmann::json& record);

/// "quantized", "disturbed" or "laboratory".
std::string condition_of(const nlohmann::json& record);

/// The diagnosis threw, died, or took too long: a miss wherever it could have been right.
bool is_failed(const nlohmann::json& record);
/// A case of `--timing`: counted for the time it takes, not otherwise.
bool is_timing(const nlohmann::json& record);

std::string first_hidden(const nlohmann::json& record);
bool is_null(const nlohmann::json& record);
bool is_unknown(const nlohmann::json& record);
bool is_pair(const nlohmann::json& record);
bool is_single(const nlohmann::json& record);

/// By the data (diagnosis_judge.hpp).
bool is_shown(const nlohmann::json& record);
bool is_clearly_shown(const nlohmann::json& record);
bool is_same_force(const nlohmann::json& record);
bool is_distinguishable(const nlohmann::json& record);

std::string first_named(const nlohmann::json& record);
bool is_right_first(const nlohmann::json& record);
/// The hidden effect is the first one named or declared not to be told from it.
bool is_right_set(const nlohmann::json& record);
bool names_both(const nlohmann::json& record);
/// Effects that are named and are not corrections of a number of the plant file.
std::size_t structural_effects(const nlohmann::json& record);
bool names_a_structure(const nlohmann::json& record);
/// The verdict says that something is there that no effect explains.
bool is_recognised(const nlohmann::json& record);
bool is_described(const nlohmann::json& record);
bool has_number(const nlohmann::json& record, const char* name);
/// A number of a record; NaN where there is none.
double number_in(const nlohmann::json& record, const char* name);
/// How many times smaller the held-out gap is with the model found; NaN without a gap.
double shrinking_of(const nlohmann::json& record);

struct Estimate {
  double error;  ///< relative
  bool covered;
};

/// Errors of the parameters of effects that were named: of hidden ones ("truth"), or of numbers of the plant
/// file that were corrected ("file_truth"). A phase counts as a share of half a turn; the centre of a spring
/// has no size of its own and is left out.
std::vector<Estimate> estimates_of(const nlohmann::json& record, const char* truths = "truth");

}  // namespace upright::blind
