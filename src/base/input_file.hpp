// Opens files that the user names: regular files only. A FIFO, a socket, a device or a folder is refused
// at once, because opening it could block permanently.
#pragma once

#include <cstdint>
#include <ext/stdio_filebuf.h>
#include <filesystem>
#include <istream>
#include <memory>
#include <string>

namespace upright {

/// Largest size of files that are read at once; larger ones were not written by hand.
inline constexpr std::uintmax_t largest_text_bytes = 16u << 20;

/// A regular file to read from.
class InputFile final : public std::istream {
 public:
  /// Throws ConfigError with name and cause when the file cannot be opened or is no regular file.
  explicit InputFile(const std::filesystem::path& file);
  /// The same, but null where there is no such file.
  static std::unique_ptr<InputFile> if_there(const std::filesystem::path& file);

  /// Size when it was opened.
  std::uintmax_t bytes() const { return bytes_; }
  /// Throws ConfigError when reading has failed (disk, network file system). Call it after the last read.
  void check() const;

 private:
  InputFile(const std::filesystem::path& file, int descriptor);

  std::filesystem::path file_;
  std::uintmax_t bytes_ = 0;
  __gnu_cxx::stdio_filebuf<char> buffer_;
};

/// The contents of a regular file. Throws ConfigError as InputFile does, and above `max_bytes`.
std::string whole_file(const std::filesystem::path& file, std::uintmax_t max_bytes = largest_text_bytes);

}  // namespace upright
