// `upright new`: asks a few questions and writes a commented plant, gain, rig or experiment file.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>

#include "check.hpp"
#include "commands.hpp"
#include "replace_all.hpp"
#include "upright/base/error.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;

/// A file to write. Its first lines are the questions: "#? NAME | QUESTION | DEFAULT", with "file " before
/// the name of an answer that is the path of a file. @NAME@ in the lines that follow stands for the answer.
struct FileTemplate {
  const char* kind;
  const char* text;
};

constexpr std::array templates = {
    FileTemplate{
        "plant",
#include "new_plant.inc"
    },
    FileTemplate{
        "gains",
#include "new_gains.inc"
    },
    FileTemplate{
        "experiment",
#include "new_experiment.inc"
    },
    FileTemplate{
        "rig simulated",
#include "new_rig_simulated.inc"
    },
    FileTemplate{
        "rig modbus-tcp",
#include "new_rig_modbus_tcp.inc"
    },
    FileTemplate{
        "rig modbus-rtu",
#include "new_rig_modbus_rtu.inc"
    },
    FileTemplate{
        "rig comedi",
#include "new_rig_comedi.inc"
    },
    FileTemplate{
        "rig quanser-hil",
#include "new_rig_quanser_hil.inc"
    },
};

struct Question {
  std::string name, words, usual;
  bool is_file = false;
};

std::string without_spaces(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r"), last = text.find_last_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

Question question_of(const std::string& line) {
  std::istringstream parts(line.substr(2));
  Question question;
  std::getline(parts, question.name, '|');
  std::getline(parts, question.words, '|');
  std::getline(parts, question.usual);
  for (std::string* part : {&question.name, &question.words, &question.usual}) *part = without_spaces(*part);
  question.is_file = question.name.starts_with("file ");
  if (question.is_file) question.name = without_spaces(question.name.substr(4));
  return question;
}

bool is_number(const std::string& text) {
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, value);
  return result.ec == std::errc{} && result.ptr == end && std::isfinite(value);
}

/// What is wrong with an answer; empty: nothing. What only the whole file shows is left to its reader.
std::string fault_of_answer(const Question& question, const std::string& answer) {
  if (is_number(question.usual) && !is_number(answer)) return "'" + answer + "' is not a number";
  if (question.is_file && !fs::is_regular_file(answer))
    return "there is no file " + answer + ": name a file that exists, or write it first with upright new";
  if (answer.find_first_of("\"\\") != std::string::npos) return "quotes and backslashes cannot be part of it";
  return "";
}

/// Asks on stderr. An empty line, or the end of the input, stands for the default.
std::string ask(const Question& question) {
  for (;;) {
    std::cerr << question.words << " [" << question.usual << "]: " << std::flush;
    std::string line;
    const bool answered = static_cast<bool>(std::getline(std::cin, line));
    if (!answered) std::cerr << "\n";
    const std::string given = without_spaces(line);
    const std::string answer = given.empty() ? question.usual : given;
    const std::string fault = fault_of_answer(question, answer);
    if (fault.empty()) return answer;
    if (!answered) throw ConfigError(fault);
    std::cerr << fault << "\n";
  }
}

const FileTemplate& template_for(const std::string& kind) {
  std::string wanted = kind;
  if (kind == "rig") {
    std::string names;
    for (const FileTemplate& known : templates)
      if (const std::string name = known.kind; name.starts_with("rig "))
        names += (names.empty() ? "" : ", ") + name.substr(4);
    wanted += " " + ask({"backend", "Backend (" + names + ")", "simulated"});
  }
  for (const FileTemplate& known : templates)
    if (known.kind == wanted) return known;
  throw ConfigError("there is no template for '" + wanted.substr(0, 80) +
                    "': copy a rig file of config/rigs, or use another backend");
}

/// The line by which an editor finds the schema of the file; empty where upright is not installed.
std::string schema_line(const std::string& kind) {
  std::error_code problem;
  const fs::path program = fs::read_symlink("/proc/self/exe", problem);
  const fs::path prefix = program.parent_path().parent_path();
  const fs::path schema = prefix / "share/upright/config/schema" / (kind + ".json");
  if (problem || !fs::exists(schema, problem)) return "";
  return "# yaml-language-server: $schema=" + schema.string() + "\n";
}

/// The text of the file, with the answers of whoever types.
std::string text_from(const FileTemplate& chosen, const std::string& first_line, const fs::path& out) {
  std::istringstream lines(chosen.text);
  std::map<std::string, std::string> answers;
  std::string text = first_line;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("#? ")) {
      const Question question = question_of(line);
      std::string answer = ask(question);
      // Files name each other relative to their own folder.
      if (question.is_file) answer = fs::proximate(answer, fs::absolute(out).parent_path()).string();
      answers[question.name] = answer;
      continue;
    }
    for (const auto& [name, answer] : answers) replace_all(line, "@" + name + "@", answer);
    text += line + "\n";
  }
  return text;
}

void write_new(const std::string& kind, const fs::path& out, bool force) {
  if (!force && fs::exists(out))
    throw ConfigError(out.string() + " exists already: choose another name with --out, or add --force");
  const std::string text = text_from(template_for(kind), schema_line(kind), out);
  // Beside it first, so that a refused file replaces none.
  const fs::path partial = out.string() + ".partial";
  std::ofstream file(partial, std::ios::binary);
  file << text;
  file.close();
  if (!file)
    throw ConfigError("cannot write " + out.string() + ": check that its folder exists and has free space");
  std::string fault = fault_of_file(partial.string());
  std::error_code problem;
  if (fault.empty()) fs::rename(partial, out, problem);
  if (fault.empty() && !problem) return;
  fs::remove(partial, problem);
  replace_all(fault, partial.string(), out.string());
  throw ConfigError((fault.empty() ? "cannot write " + out.string() + ": check its folder" : fault) +
                    " (nothing was written)");
}

}  // namespace

void add_new(CommandLine& line) {
  const Command command = line.command(
      "new", "Ask a few questions and write a commented file",
      "Examples:\n"
      "  upright new plant --out my-plant.yaml\n"
      "  upright new rig --out my-rig.yaml\n"
      "Enter accepts the value in brackets. At the end of the input the values in brackets are accepted.\n"
      "What `upright check` would refuse is not written.");
  const auto kind = std::make_shared<std::string>(), out = std::make_shared<std::string>();
  const auto force = std::make_shared<bool>(false);
  command.option("kind", *kind, "Kind of file").required().one_of({"plant", "gains", "rig", "experiment"});
  command.option("--out", *out, "File to write (default: KIND.yaml)");
  command.flag("--force", *force, "Replace an existing file");
  command.does([kind, out, force] {
    const fs::path file = out->empty() ? *kind + ".yaml" : *out;
    write_new(*kind, file, *force);
    std::cout << file.string() << "\n";
    return ExitCode::done;
  });
}

}  // namespace upright::cli
