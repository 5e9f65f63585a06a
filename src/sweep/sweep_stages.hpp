// The runs of a sweep, stage by stage: a stage is a list of cases that depend on earlier stages only, cut
// into groups the same way every time.
#pragma once

#include "sweep.hpp"
#include "sweep_journal.hpp"
#include "transition_search.hpp"

namespace upright {

class SweepStages {
 public:
  /// `journal` may be null.
  SweepStages(const SweepConfig& config, const SweepOptions& options, SweepExecutor& executor,
              SweepJournal* journal);

  /// The runs of these cases, in their order; empty when stopped.
  std::vector<SweepRun> run(const std::vector<LoopCase>& cases);

  /// Takes searches to their ends, and adds the runs made for them. False: stopped.
  bool search(std::vector<StartSearch>& searches, std::vector<SweepRun>& runs);

  /// Says that `count_plants` will be called with these cases: the progress is of all runs then.
  void expect_plants(const std::vector<LoopCase>& cases);
  /// What the plants of the sweep's uncertainty do in these cases, in their order; empty when stopped.
  std::vector<PlantCounts> count_plants(const std::vector<LoopCase>& cases);

  bool interrupted() const { return interrupted_; }
  std::size_t runs_made() const { return made_; }

 private:
  /// Applies a result; false where it is not of that task, as in a journal that a disk has damaged.
  using Take = std::function<bool(std::size_t task, const SweepNumbers& result)>;
  struct Stage {
    std::size_t number, tasks;
    SweepExecutor::TaskOf task_of;
    std::function<std::size_t(std::size_t)> cases_of, runs_of;  ///< how many, by task
    Take take;
  };
  void make(const Stage& stage);
  bool search_in_rounds(std::vector<StartSearch>& searches, std::vector<SweepRun>& runs);

  const SweepConfig& config_;
  const SweepOptions& options_;
  SweepExecutor& executor_;
  SweepJournal* journal_;
  std::size_t group_size_;
  std::size_t stage_ = 0, done_ = 0, known_ = 0, made_ = 0;
  bool interrupted_ = false;
};

/// Cases of the whole grid, neighbours in angle under one delay together: they fall at about the same time.
std::vector<LoopCase> grid_cases(const SweepConfig& config);

}  // namespace upright
