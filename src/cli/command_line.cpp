#include "command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>
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
      return name + " has no option " + flag + ": " + remedy_for(bare, flag_names(command), "--", name);
    }
    if (at_top)
      return name + " has no command " + word + ": " + remedy_for(word, command_names(app), "", name);
    return name + " does not expect '" + word + "': remove it, or see " + name + " --help";
  }
  if (at_top) return "no command was given: choose one, see " + name + " --help";
  std::string problem = error.what();
  for (char& c : problem)
    if (c == '\n') c = ' ';
  return printable(problem) + ": see " + name + " --help";
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
    return good && range.contains(value) ? std::string() : "must be a number " + range.text();
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

const Option& Option::without(const std::function<std::string(const std::string&)>& fault) const {
  option_.check(CLI::Validator([fault](std::string& text) { return fault(text); }, ""));
  return *this;
}

const Option& Option::one_of(const std::vector<std::string>& words) const {
  option_.check(CLI::IsMember(words));
  return *this;
}

const Option& Option::list_of(int count) const {
  option_.delimiter(',')->expected(count);
  return *this;
}

namespace {

/// CLI11 alone takes -1 for the largest number there is.
template <class Whole>
std::string fault_of_whole_number(const std::string& text) {
  Whole value = 0;
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, value);
  const bool good = result.ec == std::errc{} && result.ptr == end;
  return good ? std::string()
              : "must be a whole number from 0 to " + std::to_string(std::numeric_limits<Whole>::max()) +
                    ", but is " + printable(text);
}

/// CLI11 alone takes nan and inf, which pass every comparison with a limit or none.
std::string fault_of_number(const std::string& text) {
  double value = 0.0;
  const char* end = text.data() + text.size();
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto result = std::from_chars(begin, end, value);
  const bool good = result.ec == std::errc{} && result.ptr == end && std::isfinite(value);
  return good ? std::string() : "must be a finite number, but is " + printable(text);
}

template <class Value>
constexpr bool is_whole =
    std::is_same_v<Value, std::uint64_t> || std::is_same_v<Value, std::optional<std::uint64_t>>;

template <class Value>
constexpr bool is_real = std::is_same_v<Value, double> || std::is_same_v<Value, std::optional<double>> ||
                         std::is_same_v<Value, std::vector<double>>;

}  // namespace

template <class Value>
Option Command::option(const std::string& name, Value& value, const std::string& meaning) const {
  CLI::Option* option = app_.add_option(name, value, meaning);
  if constexpr (is_whole<Value>)
    option->check(
        CLI::Validator([](std::string& text) { return fault_of_whole_number<std::uint64_t>(text); }, ""));
  if constexpr (std::is_same_v<Value, unsigned>)
    option->check(
        CLI::Validator([](std::string& text) { return fault_of_whole_number<unsigned>(text); }, ""));
  if constexpr (is_real<Value>)
    option->check(CLI::Validator([](std::string& text) { return fault_of_number(text); }, ""));
  return Option(*option);
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
  flags_with_text_.insert(name);
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

/// What was typed, last word first, as CLI11 takes it: a number behind a flag that may have a text is that
/// text, as in `--live 9000`.
std::vector<std::string> CommandLine::joined(int argc, const char* const* argv) const {
  std::vector<std::string> words;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool is_number = !word.empty() && word.find_first_not_of("0123456789") == std::string::npos;
    if (is_number && !words.empty() && flags_with_text_.contains(words.back()))
      words.back() += "=" + word;
    else
      words.push_back(word);
  }
  std::reverse(words.begin(), words.end());
  return words;
}

Command CommandLine::command(const std::string& name, const std::string& summary, const std::string& footer) {
  CLI::App& command = *app_->add_subcommand(name, summary);
  command.footer(footer);
  return {command, exit_code_, flags_with_text_};
}

ExitCode CommandLine::run(int argc, const char* const* argv) {
  try {
    app_->parse(joined(argc, argv));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) throw ConfigError(sentence_for(error, *app_, name_));
    app_->exit(error);
  }
  return exit_code_;
}

namespace {

/// The words between the braces of "TEXT:{a,b}", which CLI11 writes where the value is one of few.
std::vector<std::string> words_of(const std::string& value) {
  const std::size_t open = value.find('{'), close = value.find('}');
  std::vector<std::string> words;
  if (open == std::string::npos || close == std::string::npos) return words;
  std::string word;
  for (const char c : value.substr(open + 1, close - open - 1) + ",") {
    if (c == ',')
      words.push_back(std::exchange(word, ""));
    else
      word += c;
  }
  return words;
}

OptionText text_of(const CLI::Option& option) {
  OptionText text;
  text.in_place = option.get_positional();
  if (text.in_place) text.names.push_back(option.get_single_name());
  for (const std::string& name : option.get_snames()) text.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) text.names.push_back("--" + name);
  text.meaning = option.get_description();
  // Flags take no word; --live may have a text, joined to it by '='.
  if (option.get_items_expected_max() > 0) text.value = option.get_type_name();
  text.words = words_of(text.value);
  text.required = option.get_required();
  text.many = option.get_items_expected_max() > 1;
  return text;
}

CommandText text_of(const CLI::App& app) {
  CommandText text{app.get_name(), app.get_description(), app.get_footer(), {}};
  for (const CLI::Option* option : app.get_options()) text.options.push_back(text_of(*option));
  return text;
}

}  // namespace

CommandText CommandLine::text() const {
  return text_of(*app_);
}

std::vector<CommandText> CommandLine::commands() const {
  std::vector<CommandText> texts;
  for (const CLI::App* command : app_->get_subcommands([](const CLI::App*) { return true; }))
    texts.push_back(text_of(*command));
  return texts;
}

}  // namespace upright::cli
