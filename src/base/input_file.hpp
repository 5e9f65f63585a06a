// The one way in which the program opens a file that somebody named: regular files only. A FIFO, a socket, a
// device or a folder in its place is refused at once; opening one of them could wait for ever.
#pragma once

#include <cstdint>
#include <ext/stdio_filebuf.h>
#include <filesystem>
#include <istream>
#include <memory>
#include <string>

namespace upright {

/// Files that are read at once are no larger: nobody wrote them by hand.
inline constexpr std::uintmax_t largest_text_bytes = 16u << 20;

/// A regular file to read from.
class InputFile final : public std::istream {
 public:
  /// Throws ConfigError with the file's name and the cause when it cannot be opened or is not a regular file.
  explicit InputFile(const std::filesystem::path& file);
  /// The same, but null where there is no such file.
  static std::unique_ptr<InputFile> if_there(const std::filesystem::path& file);

  /// Size when it was opened.
  std::uintmax_t bytes() const { return bytes_; }
  /// Throws ConfigError when reading has failed (the disk, a network file system). To be called at the end.
  void check() const;

 private:
  InputFile(const std::filesystem::path& file, int descriptor);

  std::filesystem::path file_;
  std::uintmax_t bytes_ = 0;
  __gnu_cxx::stdio_filebuf<char> buffer_;
};

/// All of a regular file. Throws ConfigError for what InputFile throws it for, and above `most_bytes`.
std::string whole_file(const std::filesystem::path& file, std::uintmax_t most_bytes = largest_text_bytes);

}  // namespace upright
