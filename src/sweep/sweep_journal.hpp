// The journal of an unfinished sweep: one line per group of runs, valid once it is complete.
#pragma once

#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sweep.hpp"

namespace upright {

class SweepJournal {
 public:
  /// Opens the journal of a sweep with this text, including the results of an earlier call. Throws
  /// ConfigError when it belongs to another sweep, Error when it cannot be written.
  SweepJournal(const std::filesystem::path& file, const std::string& sweep_text);
  ~SweepJournal();
  SweepJournal(const SweepJournal&) = delete;
  SweepJournal& operator=(const SweepJournal&) = delete;

  /// What came of a group if the journal has it.
  const SweepNumbers* find(std::size_t stage, std::size_t group) const;
  /// How many groups of a stage it has.
  std::size_t count(std::size_t stage) const;
  /// Keeps what came of a group of `cases` starts. Throws Error when it could not be stored.
  void keep(std::size_t stage, std::size_t group, std::size_t cases, const SweepNumbers& result);
  /// Throws Error when another program has removed or moved the journal, alone or with its folder.
  void check() const;
  /// Called once the results are written.
  void remove();

 private:
  std::filesystem::path file_;
  std::FILE* out_ = nullptr;
  std::map<std::pair<std::size_t, std::size_t>, SweepNumbers> done_;
};

}  // namespace upright
