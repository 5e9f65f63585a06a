// What is typed: the commands of `upright`, their options and flags, and where the values go.
//
// CLI11 is seen in command_line.cpp only: each file that includes it takes some twenty seconds more to
// compile.
#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "command_text.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace upright::cli {

/// What is asked of one option's value. Refers to the option, cheap to copy.
class Option {
 public:
  explicit Option(CLI::Option& option) : option_(option) {}

  const Option& required() const;
  /// A finite number. (CLI11 alone accepts nan, inf and hexadecimal.)
  const Option& in(const Range& range) const;
  /// Both ends included; `--help` shows them. `Number` is int, unsigned or double.
  template <class Number>
  const Option& from_to(Number low, Number high) const;
  /// `fault` says what is wrong with the text, or nothing.
  const Option& without(const std::function<std::string(const std::string&)>& fault) const;
  const Option& one_of(const std::vector<std::string>& words) const;
  /// So many values with commas between them.
  const Option& list_of(int count) const;

 private:
  CLI::Option& option_;
};

/// One command: its flags, and what it does. Refers to its CommandLine, cheap to copy.
class Command {
 public:
  Command(CLI::App& app, ExitCode& exit_code, std::set<std::string>& flags_with_text)
      : app_(app), exit_code_(exit_code), flags_with_text_(flags_with_text) {}

  /// `name` with its dashes, or without any for a word in its place. `value` must live until the command ran,
  /// and is left alone when the option is not given. Numbers must be finite, and fit. `Value` is a
  /// std::string, double, int, unsigned or std::uint64_t, a std::vector of the first two or a std::optional
  /// of double or std::uint64_t.
  template <class Value>
  Option option(const std::string& name, Value& value, const std::string& meaning) const;
  void flag(const std::string& name, bool& value, const std::string& meaning) const;
  /// A flag that stands for the text `usual`, or for what follows it: NAME=TEXT, or NAME and a whole number
  /// as the next word.
  void flag_or_text(const std::string& name, const std::string& usual, std::string& value,
                    const std::string& meaning) const;
  /// Called when this is the command that was typed.
  void does(std::function<ExitCode()> work) const;

 private:
  CLI::App& app_;
  ExitCode& exit_code_;
  std::set<std::string>& flags_with_text_;
};

class CommandLine {
 public:
  CommandLine(const std::string& name, const std::string& version, const std::string& summary,
              const std::string& footer);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  Command command(const std::string& name, const std::string& summary, const std::string& footer);

  /// Reads what was typed and runs that command, or prints the help that was asked for. Throws ConfigError
  /// for what makes no sense, and what the command throws.
  ExitCode run(int argc, const char* const* argv);

  const std::string& name() const noexcept { return name_; }
  /// The program itself, with the options that it has without a command.
  CommandText text() const;
  std::vector<CommandText> commands() const;

 private:
  std::vector<std::string> joined(int argc, const char* const* argv) const;

  std::string name_;
  std::unique_ptr<CLI::App> app_;
  std::set<std::string> flags_with_text_;
  ExitCode exit_code_ = ExitCode::done;
};

}  // namespace upright::cli
