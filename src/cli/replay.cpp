// `upright replay`: feeds a run's counts through its controller again.
#include "upright/record/replay.hpp"

#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "experiment/experiment.hpp"
#include "progress.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"
#include "upright/control/model_parts.hpp"

namespace upright::cli {

namespace {

using Json = nlohmann::ordered_json;

Json json_of(const RunRecord& run, const ReplayResult& result, bool truncated) {
  Json document{{"run_directory", run.path.string()},
                {"exact", !result.first_mismatch.has_value()},
                {"rows", result.rows},
                {"truncated", truncated},
                {"first_mismatch", nullptr}};
  if (result.first_mismatch) {
    const ReplayMismatch& m = *result.first_mismatch;
    document["first_mismatch"] = {{"tick", m.tick},
                                  {"logged_requested_v", m.logged_requested_v},
                                  {"computed_requested_v", m.computed_requested_v},
                                  {"logged_v", m.logged_v},
                                  {"computed_v", m.computed_v}};
  }
  return document;
}

void print(const ReplayResult& result, bool truncated) {
  if (result.first_mismatch) {
    const ReplayMismatch& m = *result.first_mismatch;
    std::cout << "First difference at tick " << m.tick << ": the log has " << exact_text(m.logged_v)
              << " V (requested " << exact_text(m.logged_requested_v) << " V), the controller gives "
              << exact_text(m.computed_v) << " V (requested " << exact_text(m.computed_requested_v)
              << " V).\n";
    if (result.first_lost_tick && *result.first_lost_tick <= m.tick)
      std::cout << "The log lost rows before tick " << *result.first_lost_tick << ".\n";
    return;
  }
  std::cout << "All " << result.rows << " voltages agree bit for bit.\n";
  if (truncated) std::cout << "The last line of the log is incomplete and was ignored.\n";
}

ExitCode replay_run(const std::string& directory, bool as_json) {
  Progress progress("replay");
  const RunRecord run = read_run_without_samples(directory);
  SampleReader rows(run.path / "samples.csv");
  const std::unique_ptr<CommandSource> script = script_of(run);
  const ReplayResult result =
      replay(run, rows, make_model_parts(run.control), script.get(), progress.callback());
  progress.end();
  if (as_json)
    std::cout << json_of(run, result, rows.truncated()).dump(2, ' ', false, Json::error_handler_t::replace)
              << "\n";
  else
    print(result, rows.truncated());
  return result.first_mismatch ? ExitCode::stopped : ExitCode::done;
}

}  // namespace

void add_replay(CommandLine& line) {
  const Command command = line.command(
      "replay", "Feed a run's logged counts through its controller and compare the voltages bit for bit",
      "Example:  upright replay runs/20260101T120000Z-run\n"
      "Exit code 3 means that a voltage differs.");
  const auto directory = std::make_shared<std::string>();
  const auto as_json = std::make_shared<bool>(false);
  command.option("run", *directory, "Run directory").required();
  command.flag("--json", *as_json, "Print one JSON document");
  command.does([directory, as_json] { return replay_run(*directory, *as_json); });
}

}  // namespace upright::cli
