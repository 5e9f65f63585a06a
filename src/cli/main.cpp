// The program: its commands, and whatever goes wrong as one sentence and an exit code.
#include <algorithm>
#include <csignal>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <vector>

#include "commands.hpp"
#include "completion.hpp"
#include "options.hpp"
#include "upright/base/error.hpp"

namespace {

using upright::ExitCode;

int fail(ExitCode code, const std::string& sentence) {
  std::cerr << "upright: " << sentence << std::endl;
  return static_cast<int>(code);
}

ExitCode run(int argc, char** argv) {
  upright::cli::CommandLine line(
      "upright", UPRIGHT_VERSION, "Real-time controller for the Quanser IP02 cart with inverted pendulum",
      "Start here:  upright run --help   (its example needs no hardware)\n"
      "Each command shows an example:  upright COMMAND --help\n"
      "Exit codes: 0 success, 2 usage or configuration error, 3 stopped or fallen, "
      "4 link or device error");
  for (upright::cli::AddCommand* add : upright::cli::all_commands) add(line);
  const std::vector<std::string> words(argv + 1, argv + std::max(argc, 1));
  const bool from_shell = !words.empty() && words.front() == upright::cli::completing;
  const ExitCode code = from_shell ? upright::cli::complete(line, words) : line.run(argc, argv);
  upright::cli::finish_output();
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  // A terminal that goes away must not kill the process that drives a motor.
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return static_cast<int>(run(argc, argv));
  } catch (const upright::Error& error) {
    return fail(error.code(), error.what());
  } catch (const std::bad_alloc&) {
    return fail(ExitCode::usage, "out of memory: use smaller input or a machine with more memory");
  } catch (const std::exception& error) {
    return fail(ExitCode::device,
                std::string("unexpected error (") + error.what() + "): please report this as a bug");
  }
}
