// The commands of `upright`: one function and one file each. `add_NAME` declares the command's flags on the
// application; the command runs while CLI11 parses and leaves its exit code. It throws Error for whatever the
// user should read; main turns that into one sentence on stderr.
#pragma once

#include <CLI/CLI.hpp>

namespace upright::cli {

void add_check(CLI::App& app, int& exit_code);
void add_design(CLI::App& app, int& exit_code);
void add_diagnose(CLI::App& app, int& exit_code);
void add_doctor(CLI::App& app, int& exit_code);
void add_effects(CLI::App& app, int& exit_code);
void add_experiment(CLI::App& app, int& exit_code);
void add_identify(CLI::App& app, int& exit_code);
void add_paper(CLI::App& app, int& exit_code);
void add_margin(CLI::App& app, int& exit_code);
void add_replay(CLI::App& app, int& exit_code);
void add_report(CLI::App& app, int& exit_code);
void add_run(CLI::App& app, int& exit_code);
void add_sweep(CLI::App& app, int& exit_code);
void add_virtual_rig(CLI::App& app, int& exit_code);

}  // namespace upright::cli
