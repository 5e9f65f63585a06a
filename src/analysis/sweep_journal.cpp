#include "sweep_journal.hpp"

#include <fstream>
#include <sstream>

#include "upright/model/error.hpp"
#include "upright/model/yaml_reader.hpp"

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

std::string line_of(std::size_t stage, std::size_t group, const std::vector<SweepRun>& runs) {
  std::ostringstream line;
  line << stage << ' ' << group << ' ' << runs.size();
  for (const SweepRun& run : runs)
    for (const double value : {run.start.theta0_rad, run.start.delay_s, run.fall_time_s,
                               run.theta_amplitude_rad, run.cart_amplitude_m})
      line << ' ' << exact_text(value);
  line << line_end;
  return line.str();
}

}  // namespace

SweepJournal::SweepJournal(const std::filesystem::path& file, const std::string& sweep_text) : file_(file) {
  const std::string header = header_for(sweep_text);
  std::uintmax_t whole_bytes = 0;
  if (std::ifstream in(file, std::ios::binary); in) {
    std::string line;
    std::getline(in, line);
    if (!line.empty() && !in.eof() && line != header)
      throw ConfigError("give another --out, or --overwrite: " + file.string() +
                        " keeps an unfinished sweep of another configuration");
    if (line == header && !in.eof()) {
      whole_bytes = line.size() + 1;
      // A line that was being written when the machine went down has no end; it is cut off below.
      while (std::getline(in, line) && !in.eof() && line.ends_with(line_end)) {
        whole_bytes += line.size() + 1;
        std::istringstream words(line);
        std::size_t stage = 0, group = 0, count = 0;
        words >> stage >> group >> count;
        std::vector<SweepRun> runs(count <= line.size() ? count : 0);
        const auto number = [&words] {
          std::string word;
          words >> word;
          return std::strtod(word.c_str(), nullptr);
        };
        for (SweepRun& run : runs) {
          run.start.theta0_rad = number();
          run.start.delay_s = number();
          run.fall_time_s = number();
          run.theta_amplitude_rad = number();
          run.cart_amplitude_m = number();
        }
        done_[{stage, group}] = std::move(runs);
      }
    }
  }
  std::error_code error;
  if (std::filesystem::exists(file, error)) std::filesystem::resize_file(file, whole_bytes, error);
  out_ = std::fopen(file.c_str(), "ab");
  const bool good = out_ != nullptr && (whole_bytes > 0 || std::fputs((header + "\n").c_str(), out_) >= 0) &&
                    std::fflush(out_) == 0;
  if (!good)
    throw Error(ExitCode::usage, "check the folder and its free space: cannot write " + file.string());
}

SweepJournal::~SweepJournal() {
  if (out_ != nullptr) std::fclose(out_);
}

const std::vector<SweepRun>* SweepJournal::find(std::size_t stage, std::size_t group) const {
  const auto it = done_.find({stage, group});
  return it == done_.end() ? nullptr : &it->second;
}

void SweepJournal::keep(std::size_t stage, std::size_t group, const std::vector<SweepRun>& runs) {
  const std::string line = line_of(stage, group, runs) + "\n";
  if (std::fputs(line.c_str(), out_) < 0 || std::fflush(out_) != 0)
    throw Error(
        ExitCode::usage,
        "free space on the disk and start again, it goes on from there: cannot write " + file_.string());
}

void SweepJournal::remove() {
  if (out_ != nullptr) std::fclose(out_);
  out_ = nullptr;
  std::error_code error;
  std::filesystem::remove(file_, error);
}

}  // namespace upright
