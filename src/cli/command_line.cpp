#include "command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

namespace upright::cli {

namespace {

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
std::string sentence_for(const CLI::ParseError& error, CLI::App& app, const std::string& program) {
  CLI::App& command = active_command(app);
  const bool at_top = &command == &app;
  const std::string name = at_top ? program : program + " " + command.get_name();
  const std::vector<std::string> strangers = app.remaining(true);
  if (!strangers.empty()) {
    const std::string word = printable(strangers.front());
    if (word.starts_with("-")) {
      const std::string flag = word.substr(0, word.find('='));
      const std::string bare = flag.substr(std::min(flag.find_first_not_of('-'), flag.size()));
      return remedy_for(bare, flag_names(command), "--", name) + ": " + name + " has no flag " + flag;
    }
    if (at_top)
      return remedy_for(word, command_names(app), "", name) + ": " + name + " has no command " + word;
    return "remove it, or see " + name + " --help: " + name + " does not expect '" + word + "'";
  }
  if (at_top) return "name a command, see " + name + " --help: nothing to do";
  std::string problem = error.what();
  for (char& c : problem)
    if (c == '\n') c = ' ';
  return "see " + name + " --help: " + printable(problem);
}

}  // namespace

const Option& Option::required() const {
  option_.required();
  return *this;
}

const Option& Option::in(const Range& range) const {
  const auto check = [range](std::string& text) {
    double value = 0.0;
    const char* end = text.data() + text.size();
    const auto result = std::from_chars(text.data(), end, value);
    const bool good = result.ec == std::errc{} && result.ptr == end && std::isfinite(value);
    return good && range.contains(value) ? std::string() : "give it a number " + range.text();
  };
  option_.check(CLI::Validator(check, ""));
  return *this;
}

template <class Number>
const Option& Option::from_to(Number low, Number high) const {
  option_.check(CLI::Range(low, high));
  return *this;
}

template const Option& Option::from_to(int, int) const;
template const Option& Option::from_to(unsigned, unsigned) const;
template const Option& Option::from_to(double, double) const;

const Option& Option::one_of(const std::vector<std::string>& words) const {
  option_.check(CLI::IsMember(words));
  return *this;
}

const Option& Option::list_of(int count) const {
  option_.delimiter(',')->expected(count);
  return *this;
}

template <class Value>
Option Command::option(const std::string& name, Value& value, const std::string& meaning) const {
  return Option(*app_.add_option(name, value, meaning));
}

template Option Command::option(const std::string&, std::string&, const std::string&) const;
template Option Command::option(const std::string&, double&, const std::string&) const;
template Option Command::option(const std::string&, int&, const std::string&) const;
template Option Command::option(const std::string&, unsigned&, const std::string&) const;
template Option Command::option(const std::string&, std::uint64_t&, const std::string&) const;
template Option Command::option(const std::string&, std::vector<std::string>&, const std::string&) const;
template Option Command::option(const std::string&, std::vector<double>&, const std::string&) const;
template Option Command::option(const std::string&, std::optional<double>&, const std::string&) const;
template Option Command::option(const std::string&, std::optional<std::uint64_t>&, const std::string&) const;

void Command::flag(const std::string& name, bool& value, const std::string& meaning) const {
  app_.add_flag(name, value, meaning);
}

void Command::flag_or_text(const std::string& name, const std::string& usual, std::string& value,
                           const std::string& meaning) const {
  app_.add_flag(name + "{" + usual + "}", value, meaning);
}

void Command::does(std::function<ExitCode()> work) const {
  app_.callback([&exit_code = exit_code_, work = std::move(work)] { exit_code = work(); });
}

CommandLine::CommandLine(const std::string& name, const std::string& version, const std::string& summary,
                         const std::string& footer)
    : name_(name), app_(std::make_unique<CLI::App>(summary, name)) {
  app_->set_version_flag("--version", name + " " + version);
  app_->require_subcommand(1);
  app_->footer(footer);
}

CommandLine::~CommandLine() = default;

Command CommandLine::command(const std::string& name, const std::string& summary, const std::string& footer) {
  CLI::App& command = *app_->add_subcommand(name, summary);
  command.footer(footer);
  return {command, exit_code_};
}

ExitCode CommandLine::run(int argc, const char* const* argv) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) throw ConfigError(sentence_for(error, *app_, name_));
    app_->exit(error);
  }
  return exit_code_;
}

}  // namespace upright::cli
