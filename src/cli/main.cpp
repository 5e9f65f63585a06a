// The command line: declares the commands, and turns whatever goes wrong into one sentence and an exit code.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <vector>

#include "commands.hpp"
#include "options.hpp"
#include "upright/model/error.hpp"
#include "upright/model/yaml_reader.hpp"

namespace {

using upright::ExitCode;
using upright::nearest_name;

/// The command whose arguments were being read: the chosen subcommand, or the application itself.
CLI::App& active_command(CLI::App& app) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  return chosen.empty() ? app : *chosen.front();
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands(nullptr)) names.push_back(command->get_name());
  return names;
}

std::vector<std::string> flag_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back(name);
  return names;
}

/// The remedy for a word nobody knows: the nearest known one, or else the help. `dashes` are those of a flag.
std::string remedy_for(const std::string& word, const std::vector<std::string>& known,
                       const std::string& dashes, const std::string& command) {
  const std::string near = nearest_name(word, known);
  const std::string help = "see " + command + " --help";
  return near.empty() ? help : "did you mean " + dashes + near + "? otherwise " + help;
}

std::string printable(const std::string& word) {
  std::string text = word.substr(0, 80);
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return text;
}

/// The sentence for what CLI11 could not make sense of.
std::string sentence_for(const CLI::ParseError& error, CLI::App& app) {
  CLI::App& command = active_command(app);
  const bool at_top = &command == &app;
  const std::string name = at_top ? "upright" : "upright " + command.get_name();
  const std::vector<std::string> strangers = app.remaining(true);
  if (!strangers.empty()) {
    const std::string word = printable(strangers.front());
    if (word.starts_with("-")) {
      const std::string flag = word.substr(0, word.find('='));
      const std::string bare = flag.substr(std::min(flag.find_first_not_of('-'), flag.size()));
      return remedy_for(bare, flag_names(command), "--", name) + ": " + name + " has no flag " + flag;
    }
    if (at_top) return remedy_for(word, command_names(app), "", name) + ": upright has no command " + word;
    return "remove it, or see " + name + " --help: " + name + " does not expect '" + word + "'";
  }
  if (at_top) return "name a command, see upright --help: nothing to do";
  std::string problem = error.what();
  for (char& c : problem)
    if (c == '\n') c = ' ';
  return "see " + name + " --help: " + printable(problem);
}

int fail(ExitCode code, const std::string& sentence) {
  std::cerr << "upright: " << sentence << std::endl;
  return static_cast<int>(code);
}

int run(int argc, char** argv) {
  CLI::App app("Real-time controller for the Quanser IP02 cart with inverted pendulum", "upright");
  app.set_version_flag("--version", "upright " UPRIGHT_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Start here:  scripts/demo.sh   (needs no hardware)\n"
      "Each command shows an example:  upright COMMAND --help\n"
      "Exit codes: 0 done; 2 usage or configuration; 3 safety stop or fall; 4 link or device");
  int exit_code = 0;
  upright::cli::add_effects(app, exit_code);
  upright::cli::add_check(app, exit_code);
  upright::cli::add_paper(app, exit_code);
  upright::cli::add_sweep(app, exit_code);
  upright::cli::add_run(app, exit_code);
  upright::cli::add_experiment(app, exit_code);
  upright::cli::add_replay(app, exit_code);
  upright::cli::add_report(app, exit_code);
  upright::cli::add_design(app, exit_code);
  upright::cli::add_margin(app, exit_code);
  upright::cli::add_diagnose(app, exit_code);
  upright::cli::add_identify(app, exit_code);
  upright::cli::add_virtual_rig(app, exit_code);
  upright::cli::add_doctor(app, exit_code);
  try {
    app.parse(argc, argv);
    upright::cli::finish_output();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    return fail(ExitCode::usage, sentence_for(error, app));
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  // A terminal that goes away must not kill the process that drives a motor.
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return run(argc, argv);
  } catch (const upright::Error& error) {
    return fail(error.code(), error.what());
  } catch (const std::bad_alloc&) {
    return fail(ExitCode::usage, "give smaller input or more memory: out of memory");
  } catch (const std::exception& error) {
    return fail(ExitCode::device, std::string("report this as a bug: unexpected error: ") + error.what());
  }
}
