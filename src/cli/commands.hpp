// The commands of `upright`: one function and one file each. `add_NAME` declares the command, its flags and
// what it does. It throws Error for whatever the user should read; main turns that into one sentence on
// stderr.
#pragma once

#include "command_line.hpp"

namespace upright::cli {

void add_check(CommandLine& line);
void add_compare(CommandLine& line);
void add_design(CommandLine& line);
void add_diagnose(CommandLine& line);
void add_doctor(CommandLine& line);
void add_effects(CommandLine& line);
void add_experiment(CommandLine& line);
void add_identify(CommandLine& line);
void add_paper(CommandLine& line);
void add_margin(CommandLine& line);
void add_replay(CommandLine& line);
void add_report(CommandLine& line);
void add_run(CommandLine& line);
void add_sweep(CommandLine& line);
void add_virtual_rig(CommandLine& line);

}  // namespace upright::cli
