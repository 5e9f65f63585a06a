// `upright completion`: the scripts by which shells complete command lines of upright. They are short, since
// they ask the program for what can follow: commands, options, words, effects, and files of the kind that the
// option takes.
#include "completion.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "replace_all.hpp"
#include "upright/model/registry.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;

/// Options, and words in their place in a command, that take a YAML file of one kind, and the key that tells
/// this kind. All others are left to the shell, which offers files of any kind.
struct TakesFile {
  const char* option;
  const char* key;
};
constexpr std::array takes_file = {
    TakesFile{"--rig", "backend"},      TakesFile{"--gains", "gains"},
    TakesFile{"--plant", "plant"},      TakesFile{"--model", "plant"},
    TakesFile{"design plant", "plant"}, TakesFile{"margin plant", "plant"},
    TakesFile{"margin gains", "gains"}, TakesFile{"simulate plant", "plant"},
    TakesFile{"sweep sweep", "sweep"},  TakesFile{"experiment file", "experiment"},
};

struct Candidate {
  std::string word, meaning;
};

/// Whether a line of the file begins with this key.
bool has_key(const fs::path& file, const std::string& key) {
  constexpr int max_lines = 1000;  // plant files and others are far shorter; a log is not worth reading
  std::ifstream in(file);
  std::string line;
  for (int i = 0; i < max_lines && std::getline(in, line); ++i)
    if (line.starts_with(key + ":")) return true;
  return false;
}

/// Folders, and files of the kind, whose path begins with `begun`.
std::vector<Candidate> files_of(const std::string& begun, const std::string& key) {
  const std::size_t slash = begun.rfind('/');
  const std::string folder = slash == std::string::npos ? "" : begun.substr(0, slash + 1);
  std::vector<Candidate> found;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder.empty() ? "." : folder, none)) {
    const std::string path = folder + entry.path().filename().string();
    if (!path.starts_with(begun) || entry.path().filename().string().starts_with('.')) continue;
    if (entry.is_directory(none))
      found.push_back({path + "/", ""});
    else if (entry.path().extension() == ".yaml" && has_key(entry.path(), key))
      found.push_back({path, ""});
  }
  return found;
}

std::vector<Candidate> values_of(const CommandText& command, const OptionText& option,
                                 const std::string& begun) {
  std::vector<Candidate> found;
  for (const std::string& word : option.words) found.push_back({word, ""});
  for (const std::string& name : option.names) {
    const std::string known_as = option.in_place ? command.name + " " + name : name;
    for (const TakesFile& takes : takes_file)
      if (known_as == takes.option) return files_of(begun, takes.key);
    if (name == "effect")
      for (const EffectInfo& info : effect_registry())
        found.push_back({std::string(info.kind), std::string(info.meaning)});
  }
  return found;
}

std::vector<Candidate> options_of(const CommandText& command) {
  std::vector<Candidate> found;
  for (const OptionText& option : command.options)
    if (!option.in_place) found.push_back({option.names.back(), option.meaning});
  return found;
}

const OptionText* option_named(const CommandText& command, const std::string& word) {
  for (const OptionText& option : command.options)
    if (!option.in_place && std::find(option.names.begin(), option.names.end(), word) != option.names.end())
      return &option;
  return nullptr;
}

/// What a word without dashes stands for: the first place for which no word was typed. A place for many
/// words, or the last one, takes all that follow.
const OptionText* place_of(const CommandText& command, const std::vector<std::string>& before) {
  std::size_t filled = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const OptionText* const option = option_named(command, before[i]);
    if (option != nullptr && !option->value.empty())
      ++i;
    else if (option == nullptr)
      ++filled;
  }
  const OptionText* place = nullptr;
  for (const OptionText& option : command.options) {
    if (!option.in_place) continue;
    place = &option;
    if (option.many || filled-- == 0) break;
  }
  return place;
}

/// `before`: the words after the name of the command.
std::vector<Candidate> candidates_in(const CommandText& command, const std::vector<std::string>& before,
                                     const std::string& begun) {
  if (!before.empty())
    for (std::size_t i = before.size(); i-- > 0;) {
      const OptionText* const option = option_named(command, before[i]);
      if (option == nullptr) continue;
      if (!option->value.empty() && (option->many || i + 1 == before.size()) && !begun.starts_with('-'))
        return values_of(command, *option, begun);
      break;
    }
  if (begun.starts_with('-')) return options_of(command);
  const OptionText* const place = place_of(command, before);
  return place == nullptr ? options_of(command) : values_of(command, *place, begun);
}

std::vector<Candidate> candidates(const CommandLine& line, const std::vector<std::string>& words) {
  const std::string& begun = words.back();
  const std::vector<CommandText> commands = line.commands();
  if (words.size() == 1) {
    if (begun.starts_with('-')) return options_of(line.text());
    std::vector<Candidate> found;
    found.reserve(commands.size());
    for (const CommandText& command : commands) found.push_back({command.name, command.summary});
    return found;
  }
  for (const CommandText& command : commands)
    if (command.name == words.front())
      return candidates_in(command, {words.begin() + 1, words.end() - 1}, begun);
  return {};
}

struct ShellScript {
  const char* shell;
  const char* text;
};

// shells/completion.*: NAME is the program's, ASK the word `completing`.
constexpr std::array scripts = {
    ShellScript{
        "bash",
#include "bash_text.inc"
    },
    ShellScript{
        "zsh",
#include "zsh_text.inc"
    },
    ShellScript{
        "fish",
#include "fish_text.inc"
    },
};

std::string script_for(const std::string& shell, const std::string& program) {
  const auto* const script = std::find_if(scripts.begin(), scripts.end(),
                                          [&](const ShellScript& known) { return known.shell == shell; });
  std::string text = script->text;
  replace_all(text, "NAME", program);
  replace_all(text, "ASK", completing);
  return text;
}

}  // namespace

ExitCode complete(const CommandLine& line, const std::vector<std::string>& words) {
  if (words.size() < 2) return ExitCode::done;
  const std::string& begun = words.back();
  for (const Candidate& candidate : candidates(line, {words.begin() + 1, words.end()}))
    if (candidate.word.starts_with(begun)) std::cout << candidate.word << '\t' << candidate.meaning << '\n';
  return ExitCode::done;
}

void add_completion(CommandLine& line) {
  const Command command = line.command(
      "completion", "Print the script by which a shell completes commands, options and files",
      "Example:  source <(upright completion bash)\n"
      "The Debian package has these scripts installed. They ask the program, so they know the commands,\n"
      "options and effects of its version, and offer files of the kind that an option takes.");
  const auto shell = std::make_shared<std::string>();
  std::vector<std::string> shells;
  shells.reserve(scripts.size());
  for (const ShellScript& script : scripts) shells.emplace_back(script.shell);
  command.option("shell", *shell, "Shell").required().one_of(shells);
  command.does([shell, program = line.name()] {
    std::cout << script_for(*shell, program);
    return ExitCode::done;
  });
}

}  // namespace upright::cli
