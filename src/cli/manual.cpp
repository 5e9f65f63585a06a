// `upright manual`: the manual pages of the program and of each command, from the texts of their help.
#include <filesystem>
#include <fstream>
#include <memory>

#include "commands.hpp"
#include "upright/base/error.hpp"

namespace upright::cli {

namespace {

/// As roff prints it: a backslash, a hyphen that can be copied, and no command at the begin of a line.
std::string roff(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (result.empty() || result.back() == '\n')
      if (c == '.' || c == '\'') result += "\\&";
    if (c == '\\')
      result += "\\e";
    else if (c == '-')
      result += "\\-";
    else
      result += c;
  }
  return result;
}

std::string lines_as_they_are(const std::string& text) {
  return ".nf\n" + roff(text) + "\n.fi\n";
}

std::string head(const std::string& page, const std::string& summary, const std::string& version) {
  return ".\\\" Written by `upright manual`.\n.TH " + page + " 1 \"\" \"upright " + version +
         "\" \"User Commands\"\n.SH NAME\n" + page + " \\- " + roff(summary) + "\n";
}

/// "--q", with what its value is; a word in its place as it is written there.
std::string shown(const OptionText& option) {
  std::string names;
  for (const std::string& name : option.names) names += (names.empty() ? "" : ", ") + roff(name);
  return "\\fB" + names + "\\fR" + (option.value.empty() ? "" : " \\fI" + roff(option.value) + "\\fR") +
         (option.required ? " (required)" : "");
}

std::string options_section(const CommandText& command) {
  std::string text = ".SH OPTIONS\n";
  for (const OptionText& option : command.options)
    text += ".TP\n" + shown(option) + "\n" + roff(option.meaning) + "\n";
  return text;
}

std::string synopsis_of(const CommandText& command, const std::string& program) {
  std::string text = ".SH SYNOPSIS\n\\fB" + program + " " + roff(command.name) + "\\fR [\\fIOPTIONS\\fR]";
  for (const OptionText& option : command.options)
    if (option.in_place) text += " \\fI" + roff(option.names.front()) + "\\fR" + (option.many ? "..." : "");
  return text + "\n";
}

constexpr const char* common_sections =
    ".SH EXIT STATUS\n"
    "0: success. 2: usage or configuration error. 3: a safety stop ended the run, or the pendulum fell. "
    "4: link or device error.\n"
    ".SH ENVIRONMENT\n.TP\n\\fBUPRIGHT_THREADS\\fR\n"
    "Number of threads. Results do not depend on it.\n"
    ".SH FILES\n.TP\n\\fI/usr/share/upright/config\\fR\n"
    "Plants, gains, rigs, sweeps and experiments of the Debian package. Paths in examples begin there.\n";

std::string command_page(const CommandText& command, const std::string& program, const std::string& version) {
  const std::string page = program + "-" + command.name;
  return head(page, command.summary, version) + synopsis_of(command, program) + options_section(command) +
         ".SH NOTES\n" + lines_as_they_are(command.footer) + common_sections + ".SH SEE ALSO\n.BR " +
         program + " (1)\n";
}

std::string program_page(const CommandLine& line, const std::string& version) {
  const CommandText program = line.text();
  std::string text = head(line.name(), program.summary, version) + ".SH SYNOPSIS\n\\fB" + line.name() +
                     "\\fR \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n" + options_section(program) + ".SH COMMANDS\n";
  for (const CommandText& command : line.commands())
    text +=
        ".TP\n\\fB" + line.name() + "\\-" + roff(command.name) + "\\fR(1)\n" + roff(command.summary) + "\n";
  return text + ".SH NOTES\n" + lines_as_they_are(program.footer) + common_sections;
}

void write_page(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  out.close();
  if (!out)
    throw Error(ExitCode::usage, "cannot write " + file.string() + ": check the folder and its free space");
}

void write_pages(const CommandLine& line, const std::string& version, const std::filesystem::path& folder) {
  std::error_code none;
  std::filesystem::create_directories(folder, none);
  write_page(folder / (line.name() + ".1"), program_page(line, version));
  for (const CommandText& command : line.commands())
    write_page(folder / (line.name() + "-" + command.name + ".1"),
               command_page(command, line.name(), version));
}

}  // namespace

void add_manual(CommandLine& line) {
  const Command command = line.command("manual", "Write the manual pages of the program and of each command",
                                       "Example:  upright manual --out man1 && man man1/upright-run.1\n"
                                       "The Debian package has these pages installed: man upright-run");
  const auto folder = std::make_shared<std::string>("man1");
  command.option("--out", *folder, "Folder to write (default: man1)");
  // The command line lives as long as its commands do.
  command.does([&line, folder] {
    write_pages(line, UPRIGHT_VERSION, *folder);
    return ExitCode::done;
  });
}

}  // namespace upright::cli
