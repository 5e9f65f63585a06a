#include "input_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "upright/base/error.hpp"

namespace upright {

namespace {

constexpr int nowhere = -1;

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a named pipe (FIFO)";
  if (S_ISSOCK(mode)) return "a socket";
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device";
  return "not a regular file";
}

[[noreturn]] void refuse(const std::filesystem::path& file, int error) {
  // A socket cannot be opened at all: say what it is.
  struct stat about {};
  if (error == ENXIO && ::stat(file.c_str(), &about) == 0 && !S_ISREG(about.st_mode))
    throw ConfigError(file.string() + " is " + kind_of(about.st_mode) + ": name a regular file");
  throw ConfigError("cannot read " + file.string() + " (" + std::strerror(error) +
                    "): check the path and its permissions");
}

/// A descriptor of a regular file; `nowhere` with errno set when it cannot be opened.
int open_regular(const std::filesystem::path& file) {
  // O_NONBLOCK: opening a FIFO without a writer does not wait; it means nothing for regular files.
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (descriptor < 0) return nowhere;
  struct stat about {};
  if (::fstat(descriptor, &about) == 0 && S_ISREG(about.st_mode)) return descriptor;
  ::close(descriptor);
  throw ConfigError(file.string() + " is " + kind_of(about.st_mode) + ": name a regular file");
}

int opened(const std::filesystem::path& file) {
  const int descriptor = open_regular(file);
  if (descriptor == nowhere) refuse(file, errno);
  return descriptor;
}

}  // namespace

InputFile::InputFile(const std::filesystem::path& file) : InputFile(file, opened(file)) {}

InputFile::InputFile(const std::filesystem::path& file, int descriptor)
    : std::istream(nullptr), file_(file), buffer_(descriptor, std::ios::in | std::ios::binary) {
  struct stat about {};
  if (::fstat(descriptor, &about) == 0) bytes_ = static_cast<std::uintmax_t>(about.st_size);
  rdbuf(&buffer_);
}

std::unique_ptr<InputFile> InputFile::if_there(const std::filesystem::path& file) {
  const int descriptor = open_regular(file);
  if (descriptor == nowhere && (errno == ENOENT || errno == ENOTDIR)) return nullptr;
  if (descriptor == nowhere) refuse(file, errno);
  return std::unique_ptr<InputFile>(new InputFile(file, descriptor));
}

void InputFile::check() const {
  if (bad()) throw ConfigError(file_.string() + " could not be read completely: check the disk");
}

std::string whole_file(const std::filesystem::path& file, std::uintmax_t max_bytes) {
  InputFile in(file);
  std::string text;
  constexpr std::size_t part_bytes = 1 << 16;
  for (std::size_t kept = 0; in; kept = text.size()) {
    if (kept > max_bytes || in.bytes() > max_bytes)
      throw ConfigError(file.string() + " is larger than " + std::to_string(max_bytes >> 20) +
                        " MiB: name a smaller file");
    text.resize(kept + part_bytes);
    in.read(text.data() + kept, part_bytes);
    text.resize(kept + static_cast<std::size_t>(in.gcount()));
  }
  in.check();
  return text;
}

}  // namespace upright
