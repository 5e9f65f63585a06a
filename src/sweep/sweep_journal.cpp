#include "sweep_journal.hpp"

#include <sys/stat.h>

#include <sstream>

#include "base/input_file.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

namespace {

/// FNV-1a over the sweep's text: tells one sweep from another.
std::string fingerprint(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  std::ostringstream out;
  out << std::hex << hash;
  return out.str();
}

std::string header_for(const std::string& sweep_text) {
  return "upright-sweep 1 " + fingerprint(sweep_text);
}

constexpr const char* line_end = " .";

std::string line_of(std::size_t stage, std::size_t group, std::size_t cases, const SweepNumbers& result) {
  std::ostringstream line;
  line << stage << ' ' << group << ' ' << cases;
  for (const double value : result) line << ' ' << exact_text(value);
  line << line_end;
  return line.str();
}

/// The numbers of a line that line_of() wrote, after its first three.
SweepNumbers numbers_in(std::istringstream& words) {
  SweepNumbers numbers;
  for (std::string word; words >> word && word != ".";) numbers.push_back(std::strtod(word.c_str(), nullptr));
  return numbers;
}

}  // namespace

SweepJournal::SweepJournal(const std::filesystem::path& file, const std::string& sweep_text) : file_(file) {
  const std::string header = header_for(sweep_text);
  std::uintmax_t whole_bytes = 0;
  if (const std::unique_ptr<InputFile> in = InputFile::if_there(file)) {
    std::string line;
    std::getline(*in, line);
    if (!line.empty() && !in->eof() && line != header)
      throw ConfigError(
          file.string() +
          " belongs to an unfinished sweep with another configuration: choose another folder with --out, or "
          "discard it with --overwrite");
    if (line == header && !in->eof()) {
      whole_bytes = line.size() + 1;
      // A line that was being written when the machine went down has no end; it is cut off below.
      while (std::getline(*in, line) && !in->eof() && line.ends_with(line_end)) {
        whole_bytes += line.size() + 1;
        std::istringstream words(line);
        std::size_t stage = 0, group = 0, cases = 0;
        words >> stage >> group >> cases;
        done_[{stage, group}] = numbers_in(words);
      }
    }
  }
  std::error_code error;
  if (std::filesystem::exists(file, error)) std::filesystem::resize_file(file, whole_bytes, error);
  out_ = std::fopen(file.c_str(), "ab");
  const bool good = out_ != nullptr && (whole_bytes > 0 || std::fputs((header + "\n").c_str(), out_) >= 0) &&
                    std::fflush(out_) == 0;
  if (!good)
    throw Error(ExitCode::usage, "cannot write " + file.string() + ": check the folder and its free space");
}

SweepJournal::~SweepJournal() {
  if (out_ != nullptr) std::fclose(out_);
}

const SweepNumbers* SweepJournal::find(std::size_t stage, std::size_t group) const {
  const auto it = done_.find({stage, group});
  return it == done_.end() ? nullptr : &it->second;
}

std::size_t SweepJournal::count(std::size_t stage) const {
  return static_cast<std::size_t>(
      std::distance(done_.lower_bound({stage, 0}), done_.lower_bound({stage + 1, 0})));
}

void SweepJournal::check() const {
  struct stat held {
  }, named{};
  if (::fstat(::fileno(out_), &held) != 0) return;
  const bool in_place =
      ::stat(file_.c_str(), &named) == 0 && named.st_ino == held.st_ino && named.st_dev == held.st_dev;
  if (in_place) return;
  const std::string folder = file_.parent_path().string();
  std::error_code problem;
  const std::filesystem::path now =
      std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(::fileno(out_)), problem);
  if (held.st_nlink == 0 || problem)
    throw Error(ExitCode::usage, folder +
                                     " or its sweep.partial was removed during the sweep, so its runs are "
                                     "lost: start the sweep again, and do not change the folder");
  throw Error(ExitCode::usage,
              folder + " was moved to " + now.parent_path().string() +
                  " during the sweep: start the same command with that folder as --out to continue");
}

void SweepJournal::keep(std::size_t stage, std::size_t group, std::size_t cases, const SweepNumbers& result) {
  check();
  const std::string line = line_of(stage, group, cases, result) + "\n";
  if (std::fputs(line.c_str(), out_) < 0 || std::fflush(out_) != 0)
    throw Error(ExitCode::usage, "cannot write " + file_.string() +
                                     ": free some space, and start the same command again to continue");
}

void SweepJournal::remove() {
  if (out_ != nullptr) std::fclose(out_);
  out_ = nullptr;
  std::error_code error;
  std::filesystem::remove(file_, error);
}

}  // namespace upright
