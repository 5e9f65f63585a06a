// `upright export`: measured data and plants for other programs.
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "measurement/mat_file.hpp"
#include "options.hpp"
#include "result_folder.hpp"
#include "sim/fmu/fmu_writer.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"
#include "upright/measurement/measurement.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/record/run_reader.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;

struct ExportFlags {
  std::string path, out;
  bool mat = false, csv = false, fmu = false;
};

/// Columns of equal length, with their names.
using ExportedColumns = std::vector<std::pair<std::string, std::vector<double>>>;

/// One column of samples.csv as a number.
struct ExportedCell {
  const char* name;
  double (*value)(const LogRecord&);
};

constexpr ExportedCell exported_cells[] = {
    {"time_s", [](const LogRecord& r) { return static_cast<double>(r.time_ns) / 1e9; }},
    {"voltage_v", [](const LogRecord& r) { return r.voltage_v; }},
    {"cart_m", [](const LogRecord& r) { return r.cart_m; }},
    {"theta_rad", [](const LogRecord& r) { return r.theta_rad; }},
    {"cart_velocity_mps", [](const LogRecord& r) { return r.cart_velocity_mps; }},
    {"pendulum_rate_radps", [](const LogRecord& r) { return r.pendulum_rate_radps; }},
    {"voltage_requested_v", [](const LogRecord& r) { return r.voltage_requested_v; }},
    {"tick", [](const LogRecord& r) { return static_cast<double>(r.tick); }},
    {"cart_counts", [](const LogRecord& r) { return static_cast<double>(r.cart_counts); }},
    {"pendulum_counts", [](const LogRecord& r) { return static_cast<double>(r.pendulum_counts); }},
    {"wake_late_us", [](const LogRecord& r) { return static_cast<double>(r.wake_late_ns) / 1e3; }},
    {"flags", [](const LogRecord& r) { return static_cast<double>(r.flags); }},
};

ExportedColumns columns_of_run(const fs::path& samples) {
  ExportedColumns columns;
  for (const ExportedCell& cell : exported_cells) columns.emplace_back(cell.name, std::vector<double>{});
  SampleReader reader(samples);
  for (LogRecord row; reader.next(row); row = {})
    for (std::size_t i = 0; i < columns.size(); ++i)
      columns[i].second.push_back(exported_cells[i].value(row));
  return columns;
}

ExportedColumns columns_of_data(const fs::path& data) {
  const Measurement run = read_measurement(data);
  ExportedColumns columns = {{"time_s", run.time_s}, {"voltage_v", run.voltage_v}};
  if (run.has_cart()) columns.emplace_back("cart_m", run.cart_m);
  if (run.has_theta()) columns.emplace_back("theta_rad", run.theta_rad);
  return columns;
}

void write_csv(const ExportedColumns& columns, std::ostream& out) {
  for (std::size_t i = 0; i < columns.size(); ++i) out << (i > 0 ? "," : "") << columns[i].first;
  out << '\n';
  for (std::size_t k = 0; k < columns[0].second.size(); ++k) {
    for (std::size_t i = 0; i < columns.size(); ++i)
      out << (i > 0 ? "," : "") << exact_text(columns[i].second[k]);
    out << '\n';
  }
}

/// RUN/ and data.yaml become RUN.mat and data.mat, in the present folder.
fs::path usual_name(const fs::path& path, const char* ending) {
  const fs::path name = path.filename().empty() ? path.parent_path().filename() : path.filename();
  std::error_code problem;
  return fs::is_directory(path, problem) ? fs::path(name.string() + ending)
                                         : fs::path(name).replace_extension(ending);
}

void export_data(const fs::path& path, const fs::path& file, bool as_mat) {
  const bool is_run = fs::exists(path / "samples.csv");
  const ExportedColumns columns = is_run ? columns_of_run(path / "samples.csv") : columns_of_data(path);
  if (columns[0].second.empty()) throw ConfigError(path.string() + " has no rows: record a longer run");
  if (as_mat) {
    write_mat_file(file, columns);
  } else {
    write_result(file, [&](std::ostream& out) { write_csv(columns, out); });
  }
}

ExitCode run_export(const ExportFlags& flags) {
  if (flags.mat + flags.csv + flags.fmu != 1)
    throw ConfigError("what to write is not clear: give one of --mat, --csv and --fmu");
  const fs::path path = flags.path;
  const char* ending = flags.mat ? ".mat" : flags.csv ? ".csv" : ".fmu";
  const fs::path file = flags.out.empty() ? usual_name(path, ending) : fs::path(flags.out);
  if (fs::exists(file))
    throw ConfigError(file.string() + " already exists: choose another file with --out, or remove it");
  if (flags.fmu) {
    write_fmu(read_plant_file(path), path.stem().string(), file);
  } else {
    export_data(path, file, flags.mat);
  }
  std::cout << file.string() << std::endl;
  finish_output();
  return ExitCode::done;
}

}  // namespace

void add_export(CommandLine& line) {
  const Command command = line.command(
      "export", "Write measured data or a plant for other programs: MATLAB, CSV, or an FMU",
      "Examples:\n"
      "  upright export runs/20260101T120000Z-run --mat --out run.mat\n"
      "  upright export config/plants/exponential.yaml --fmu\n"
      "Of a run directory, all quantities of each row are written; of other data, the time, the voltage,\n"
      "and what was measured, in SI units. An FMU (FMI 2.0, co-simulation) has the event engine in it:\n"
      "voltage in; position, angle, velocities and forces out. Prints the name of the file.");
  const auto flags = std::make_shared<ExportFlags>();
  command
      .option("path", flags->path,
              "Run directory, CSV file, MATLAB file or dataset file; with --fmu, a plant file")
      .required();
  command.flag("--mat", flags->mat, "Write a MATLAB v5 file with a column vector for each quantity");
  command.flag("--csv", flags->csv, "Write a CSV file with a header line");
  command.flag("--fmu", flags->fmu, "Write the plant as an FMU for Linux on x86-64");
  command.option("--out", flags->out,
                 "File to write (default: the name of PATH with the ending .mat, .csv or .fmu)");
  command.does([flags] { return run_export(*flags); });
}

}  // namespace upright::cli
