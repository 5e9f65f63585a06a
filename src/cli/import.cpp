// `upright import`: a first dataset file for a foreign CSV or MATLAB file, and a look at what it reads.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "base/number_text.hpp"
#include "commands.hpp"
#include "json_number.hpp"
#include "measurement/import_proposal.hpp"
#include "options.hpp"
#include "report/import_report.hpp"
#include "result_folder.hpp"
#include "upright/base/error.hpp"
#include "upright/measurement/measurement.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct ImportFlags {
  std::string file, out;
  double seconds = 5.0;
  bool as_json = false;
};

Json columns_json(const ImportProposal& proposal) {
  Json columns = Json::object();
  for (const ProposedColumn& column : proposal.columns)
    columns[column.quantity] = column.column.empty()
                                   ? Json(nullptr)
                                   : Json{{"column", column.column},
                                          {"unit", column.unit.empty() ? Json(nullptr) : Json(column.unit)}};
  return columns;
}

void print_range(const char* name, const char* unit, const std::vector<double>& values) {
  if (values.empty()) return;
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  std::printf("  %-9s %s to %s %s\n", name, number_text(*low).c_str(), number_text(*high).c_str(), unit);
}

void print(const Measurement& run, const fs::path& dataset, const fs::path& page) {
  std::printf("%zu rows, %s s, one every %s ms:\n", run.size(),
              number_text(run.time_s.back() - run.time_s.front()).c_str(),
              number_text(1e3 * run.median_period_s()).c_str());
  print_range("cart", "m", run.cart_m);
  print_range("angle", "rad", run.theta_rad);
  print_range("voltage", "V", run.voltage_v);
  for (const std::string& note : run.notes) std::printf("Note: %s.\n", note.c_str());
  std::printf("Written: %s %s\n", dataset.c_str(), page.c_str());
  std::fflush(stdout);
}

/// "time_s, voltage_v": what no column was recognised for.
std::string missing_of(const ImportProposal& proposal) {
  std::string missing;
  for (const ProposedColumn& column : proposal.columns)
    if (column.column.empty()) missing += (missing.empty() ? "" : ", ") + column.quantity;
  return missing;
}

ExitCode run_import(const ImportFlags& flags) {
  const fs::path file = flags.file;
  const fs::path dataset =
      flags.out.empty() ? fs::path(file).replace_extension(".yaml") : fs::path(flags.out);
  const fs::path page = fs::path(dataset).replace_extension(".html");
  if (fs::exists(dataset))
    throw ConfigError(dataset.string() + " already exists: choose another file with --out, or remove it");
  const ImportProposal proposal = propose_mapping(file);
  const std::string text = dataset_text(proposal, dataset.parent_path());
  write_result(dataset, [&](std::ostream& out) { out << text; });
  if (!flags.as_json) std::cout << text << std::endl;
  std::optional<Measurement> run;
  std::string problem;
  try {
    run = read_measurement(dataset);
    write_import_report(*run, flags.seconds, page);
  } catch (const ConfigError& error) {
    problem = error.what();
  }
  if (flags.as_json) {
    const Json document = {{"dataset", dataset.string()},
                           {"page", run ? Json(page.string()) : Json(nullptr)},
                           {"columns", columns_json(proposal)},
                           {"not_used", proposal.others},
                           {"complete", proposal.is_complete()},
                           {"rows", run ? Json(run->size()) : Json(nullptr)},
                           {"notes", run ? Json(run->notes) : Json::array()}};
    std::cout << document.dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  } else if (run) {
    print(*run, dataset, page);
  }
  finish_output();
  if (run) return ExitCode::done;
  if (!proposal.is_complete())
    problem = "no column of " + file.string() + " was recognised for " + missing_of(proposal);
  throw ConfigError(problem + ": complete " + dataset.string() + ", then run upright check on it");
}

}  // namespace

void add_import(CommandLine& line) {
  const Command command =
      line.command("import", "Propose a dataset file for a CSV or MATLAB file, and plot its first seconds",
                   "Example:  upright import measured.mat && upright check measured.yaml\n"
                   "The mapping comes from the names of the columns and their units. Check each line of it.");
  const auto flags = std::make_shared<ImportFlags>();
  command.option("file", flags->file, "CSV or MATLAB file").required();
  command.option(
      "--out", flags->out,
      "Dataset file to write (default: FILE with the ending .yaml). The page has the ending .html");
  command.option("--seconds", flags->seconds, "How much of the record the page shows [s] (default: 5)")
      .in(Range::positive());
  command.flag("--json", flags->as_json, "Print one JSON document");
  command.does([flags] { return run_import(*flags); });
}

}  // namespace upright::cli
