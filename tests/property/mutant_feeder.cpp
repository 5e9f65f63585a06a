#include "mutant_feeder.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <regex>

#include "mutator.hpp"
#include "upright/base/error.hpp"

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/common_interface_defs.h>

/// No file that somebody gives may make the program ask for a gibibyte.
extern "C" const char* __asan_default_options() {
  return "max_allocation_size_mb=1024:allocator_may_return_null=0:hard_rss_limit_mb=3072";
}
#endif

namespace upright::testing {
namespace {

namespace fs = std::filesystem;

char current[160];

std::uint64_t number_of(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

/// Nothing but the name of the mutant can be said in a signal handler.
void say(const char* words) {
  [[maybe_unused]] ssize_t n = ::write(STDERR_FILENO, words, std::strlen(words));
  n = ::write(STDERR_FILENO, current, std::strlen(current));
}

extern "C" void report_hang(int) {
  say("hangs: ");
  ::_exit(99);
}

extern "C" void report_crash(int number) {
  say("crashes: ");
  std::signal(number, SIG_DFL);
  std::raise(number);
}

void watch_for_crashes() {
#ifdef __SANITIZE_ADDRESS__
  __sanitizer_set_death_callback([] { say("the sanitizer ends: "); });
#else
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGABRT}) std::signal(number, report_crash);
  rlimit limit{};
  limit.rlim_cur = limit.rlim_max = rlim_t{2} << 30;
  ::setrlimit(RLIMIT_AS, &limit);
#endif
}

/// Ends the program where one mutant takes far more processor time than it may.
void watch_for_hangs(double seconds) {
  std::signal(SIGPROF, report_hang);
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(seconds);
  ::setitimer(ITIMER_PROF, &timer, nullptr);
}

double processor_time_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// True where a refusal names a file of the folder, or one that is not there, and the line where what is
/// wrong has one.
bool has_place(const std::string& sentence, const fs::path& folder) {
  static const std::regex line(":[0-9]+: ");
  static const std::regex whole(
      "cannot read|cannot be read|is a folder|larger than|is none|has no run.yaml|another experiment|"
      "holds no|contains no|holds constant data|does not begin with the header|has an incomplete row|rows "
      "have|has the unknown outcome|unknown verdict|unfinished sweep|with the gains of");
  if (sentence.starts_with("cannot read /")) return true;
  if (sentence.find(folder.string()) == std::string::npos) return false;
  return std::regex_search(sentence, line) || std::regex_search(sentence, whole);
}

struct Tally {
  std::uint64_t read = 0, refused = 0, failed = 0;
  double longest_s = 0.0;
};

/// Reads one mutant. False: not as it should be.
bool read_one(const Diet& diet, const Folder& folder, const fs::path& file, const Reader& reader,
              Tally& tally) {
  bool good = true;
  const auto fail = [&](const std::string& words) {
    ADD_FAILURE() << current << words;
    good = false;
  };
  watch_for_hangs(std::max(30.0, 5.0 * diet.longest_s));
  const double begun_s = processor_time_s();
  try {
    reader(file);
    ++tally.read;
  } catch (const Error& error) {
    ++tally.refused;
    const std::string sentence = error.what();
    if (!has_place(sentence, folder.path())) fail(sentence);
  } catch (const std::exception& problem) {
    fail(std::string("not an Error: ") + problem.what());
  }
  const double took_s = processor_time_s() - begun_s;
  watch_for_hangs(0.0);
  tally.longest_s = std::max(tally.longest_s, took_s);
  if (took_s > diet.longest_s) fail("takes " + std::to_string(took_s) + " s");
  return good;
}

}  // namespace

std::uint64_t mutants() {
  return number_of("UPRIGHT_MUTANTS", 60);
}

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << text;
}

std::vector<std::string> own_texts(const char* folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(config / folder))
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());  // the same mutants on every machine
  std::vector<std::string> texts;
  for (const fs::path& file : files) {
    std::string text = text_of(file);
    // All of them are written into a folder beside those that they name.
    for (std::size_t at; (at = text.find("../../")) != std::string::npos;) text.erase(at, 3);
    texts.push_back(text);
  }
  return texts;
}

Folder::Folder() {
  std::string name = (fs::temp_directory_path() / "upright-mutants-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  path_ = name;
  for (const char* part : {"plants", "gains", "rigs"})
    fs::copy(config / part, path_ / part, fs::copy_options::recursive);
  for (const char* part : {"experiments", "sweeps"}) fs::create_directory(path_ / part);
}

Folder::~Folder() {
  std::error_code ignored;
  if (!::testing::Test::HasFailure()) fs::remove_all(path_, ignored);
}

const char* current_mutant() {
  return current;
}

void feed(const Diet& diet, const Folder& folder, std::uint64_t count, const Reader& reader) {
  constexpr std::uint64_t max_failures = 5;
  const Mutator mutator(diet.texts);
  const std::uint64_t first = number_of("UPRIGHT_MUTANT_SEED", 1);
  const fs::path file = folder.path() / diet.name;
  Tally tally;
  watch_for_crashes();
  for (std::uint64_t seed = first; seed < first + count && tally.failed < max_failures; ++seed) {
    std::snprintf(current, sizeof current, "%s, seed %llu, %s\n", diet.kind,
                  static_cast<unsigned long long>(seed), file.c_str());
    const std::string text = mutator.mutant(seed);
    write(file, text);
    if (read_one(diet, folder, file, reader, tally)) continue;
    ++tally.failed;
    write(file.string() + "." + std::to_string(seed), text);
  }
  std::printf("%-14s %6llu read, %6llu refused, longest %.3f s\n", diet.kind,
              static_cast<unsigned long long>(tally.read), static_cast<unsigned long long>(tally.refused),
              tally.longest_s);
  std::fflush(stdout);
}

}  // namespace upright::testing
