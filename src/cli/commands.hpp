// The registration of every command of `upright`: one function and one file each. `add_NAME` declares the
// command, its flags and what it does. It throws Error for whatever the user should read; main turns that
// into one sentence on stderr. Their order here is the order of the help.
#pragma once

#include <array>

#include "command_line.hpp"

namespace upright::cli {

using AddCommand = void(CommandLine&);

// clang-format off
AddCommand add_effects,
           add_check,
           add_new,
           add_schema,
           add_paper,
           add_sweep,
           add_run,
           add_experiment,
           add_replay,
           add_report,
           add_compare,
           add_design,
           add_optimise,
           add_margin,
           add_diagnose,
           add_identify,
           add_simulate,
           add_import,
           add_export,
           add_virtual_rig,
           add_doctor,
           add_completion,
           add_manual;

inline constexpr std::array all_commands = {add_effects,
                                            add_check,
                                            add_new,
                                            add_schema,
                                            add_paper,
                                            add_sweep,
                                            add_run,
                                            add_experiment,
                                            add_replay,
                                            add_report,
                                            add_compare,
                                            add_design,
                                            add_optimise,
                                            add_margin,
                                            add_diagnose,
                                            add_identify,
                                            add_simulate,
                                            add_import,
                                            add_export,
                                            add_virtual_rig,
                                            add_doctor,
                                            add_completion,
                                            add_manual};
// clang-format on

}  // namespace upright::cli
