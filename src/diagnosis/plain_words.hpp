// The residual sentence and the notes of a diagnosis in the words that people read.
//
// Their values in diagnosis.json do not change, because programs may compare them. What a person reads, on
// the terminal and in a report, replaces the phrases below. scripts/check_prose.py reads this table: it
// accepts the fixed phrases in the program's texts.
#pragma once

#include <string>
#include <string_view>

namespace upright {

struct FixedPhrase {
  std::string_view fixed, plain;
};

/// Replaced in this order.
inline constexpr FixedPhrase fixed_phrases[] = {
    {"what is left is too quick for a force", "the residual is concentrated at high frequency"},
    {", so it is in what the sensors show", ", so it comes from a sensor, not from a force"},
    {"what is left is too slow for noise",
     "the residual is concentrated at low frequency, so it is not noise"},
    {"as large as noise that accounts for single samples makes it",
     "the value expected from the noise of single samples"},
    {"a plain simulation is", "the error of an open-loop simulation is"},
    {"a plain simulation of held-out runs is", "the error of an open-loop simulation of held-out runs is"},
    {"a simulation of runs that the fit did not see is", "the error of a simulation of held-out runs is"},
    {"as far off as noise like what is left of the others makes it at most",
     "the largest error expected from noise like the residual of the other runs"},
    {"as far off as noise like what is left makes it at most",
     "the largest error expected from noise like the residual"},
    {"as far off as such noise makes it at most", "the largest error expected from such noise"},
    {"is a disturbance that is the same all along and goes with nothing that was measured",
     "is a disturbance of constant strength that does not depend on any measured quantity"},
    {"as far off as most", "as large as most"},
    {"goes with", "depends on"},
    {"what is left", "the residual"},
};

/// `sentence` with every fixed phrase replaced by its plain form.
std::string in_plain_words(std::string sentence);

}  // namespace upright
