#include "gnuplot.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "upright/base/error.hpp"

namespace upright {

namespace {

[[noreturn]] void fail(const std::string& sentence) {
  throw Error(ExitCode::usage, sentence);
}

/// A file in memory, since a pipe can block and a disk can be full.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) : descriptor_(memfd_create(name, MFD_CLOEXEC)) {
    if (descriptor_ < 0) fail("there is no memory to draw plots in: close other programs");
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int descriptor() const { return descriptor_; }

  void write(std::string_view text) {
    while (!text.empty()) {
      const ssize_t written = ::write(descriptor_, text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) fail("there is no memory to draw plots in: close other programs");
      text.remove_prefix(static_cast<std::size_t>(written));
    }
    lseek(descriptor_, 0, SEEK_SET);
  }

  std::string read() {
    lseek(descriptor_, 0, SEEK_SET);
    std::string text;
    std::array<char, 65536> part;
    for (;;) {
      const ssize_t count = ::read(descriptor_, part.data(), part.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return text;
      text.append(part.data(), static_cast<std::size_t>(count));
    }
  }

 private:
  int descriptor_;
};

int wait_for(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

pid_t start(const MemoryFile& in, const MemoryFile& out, const MemoryFile& err) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.descriptor(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out.descriptor(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.descriptor(), STDERR_FILENO);
  // -d: the user's own ~/.gnuplot must not change a report.
  std::array<char, 8> program{"gnuplot"};
  std::array<char, 3> no_defaults{"-d"};
  const std::array<char*, 3> arguments{program.data(), no_defaults.data(), nullptr};
  pid_t child = 0;
  const int problem = posix_spawnp(&child, program.data(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (problem == ENOENT)
    fail("gnuplot, which draws the plots, is not installed: apt-get install gnuplot-nox");
  if (problem != 0)
    fail("gnuplot cannot be started (" + std::string(strerror(problem)) + "): check that it runs");
  return child;
}

/// The last line that is not empty. Before it, gnuplot repeats the part of the script that failed.
std::string error_line_of(const std::string& text) {
  const std::size_t end = text.find_last_not_of(" \n");
  if (end == std::string::npos) return "no message";
  const std::size_t begin = text.rfind('\n', end);
  return text.substr(begin == std::string::npos ? 0 : begin + 1, end - begin);
}

}  // namespace

std::string gnuplot_output(const std::string& script) {
  MemoryFile in("gnuplot-script");
  MemoryFile out("gnuplot-output");
  MemoryFile err("gnuplot-errors");
  in.write(script);
  const int exit_code = wait_for(start(in, out, err));
  if (exit_code == 127) fail("gnuplot, which draws the plots, is not installed: apt-get install gnuplot-nox");
  if (exit_code != 0)
    fail("gnuplot failed (" + error_line_of(err.read()) + "): check that gnuplot 5 works here");
  return out.read();
}

}  // namespace upright
