// Feeds mutants to what reads them, and watches over time, memory and exceptions.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace upright::testing {

/// The repository's own configuration.
inline const std::filesystem::path config = std::filesystem::path(UPRIGHT_SOURCE_DIR) / "config";

/// Processor time under the sanitizers that a mutant may take: to be read and used where the work is that of
/// a file; where a motion is simulated, whose steps are bounded; where an experiment is planned, which has a
/// bound of its own (docs/reference/experiment-files.md).
inline constexpr double longest_read_s = 2.0, longest_motion_s = 20.0, longest_plan_s = 60.0;

/// How many mutants of each kind: UPRIGHT_MUTANTS, 60 where it is not set.
std::uint64_t mutants();

std::string text_of(const std::filesystem::path& file);
void write(const std::filesystem::path& file, const std::string& text);

/// The repository's own files of a kind. What they name is found from that folder of a Folder.
std::vector<std::string> own_texts(const char* folder);

/// A folder with the repository's plants, gains and rigs, for those that mutants name. It is removed at the
/// end, unless a mutant in it is evidence.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// What is fed now, for messages.
const char* current_mutant();

using Reader = std::function<void(const std::filesystem::path& file)>;

/// A kind of file: good texts of it, the name under which its mutants are written, and what they may take.
struct Diet {
  const char* kind;
  std::vector<std::string> texts;
  std::string name;
  double longest_s = longest_read_s;
};

/// Gives `count` mutants, written to FOLDER/NAME, to the reader. Each is read, or refused with an Error that
/// says where; anything else is a failure, after which the mutant is kept as FOLDER/NAME.SEED.
void feed(const Diet& diet, const Folder& folder, std::uint64_t count, const Reader& reader);

}  // namespace upright::testing
