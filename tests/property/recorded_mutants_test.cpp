// Mutants of what the program or somebody else recorded: runs, experiments, sign records, foreign data,
// sweeps and diagnoses, given to whatever reads them back. See mutants_test.cpp.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "comparison/run_behaviour.hpp"
#include "experiment/experiment.hpp"
#include "measurement/data_check.hpp"
#include "mutant_feeder.hpp"
#include "record/sign_record.hpp"
#include "report/diagnosis_report.hpp"
#include "report/experiment_report.hpp"
#include "report/run_report.hpp"
#include "report/sweep_report.hpp"
#include "short_experiments.hpp"
#include "sweep/sweep.hpp"
#include "upright/base/error.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/measurement/measurement.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/record/replay.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;

/// A program in gnuplot's place that draws nothing: drawing is not what mutants are about, and takes longer
/// than all the rest.
class QuickGnuplot {
 public:
  explicit QuickGnuplot(const fs::path& folder) : path_(std::getenv("PATH")) {
    fs::create_directories(folder / "bin");
    const fs::path program = folder / "bin" / "gnuplot";
    write(program, "#!/bin/sh\nexec echo '<svg xmlns=\"http://www.w3.org/2000/svg\"></svg>'\n");
    fs::permissions(program, fs::perms::owner_all);
    ::setenv("PATH", ((folder / "bin").string() + ":" + path_).c_str(), 1);
  }
  ~QuickGnuplot() { ::setenv("PATH", path_.c_str(), 1); }
  QuickGnuplot(const QuickGnuplot&) = delete;
  QuickGnuplot& operator=(const QuickGnuplot&) = delete;

 private:
  std::string path_;
};

ExperimentSetup setup_of(const fs::path& file) {
  return resolve_experiment(file, config / "rigs" / "simulated.yaml", "", std::nullopt);
}

/// A short experiment in virtual time; returns its folder.
fs::path make_experiment(const fs::path& folder, const std::string& text) {
  const fs::path file = folder / "experiments" / "short.yaml";
  write(file, text);
  const ExperimentSetup setup = setup_of(file);
  VirtualClock clock;
  const auto rig = make_simulated_rig(setup.rig, clock, {});
  const SignalFlag signal{0};
  ExperimentOptions options;
  options.folder = folder / "made";
  run_experiment(setup, plan_pieces(setup), *rig, rig.get(), clock, signal, options);
  return options.folder;
}

/// The run directory of a short piece, with so many bytes of its samples.
fs::path make_run(const fs::path& folder, const std::string& text, std::size_t bytes) {
  const fs::path made = make_experiment(folder, text);
  const fs::path run = folder / "run";
  fs::create_directory(run);
  const fs::path first = made / read_trials(made).at(0).run_directory;
  std::string samples = text_of(first / "samples.csv");
  samples.resize(samples.find('\n', std::min(bytes, samples.size() - 2)) + 1);
  write(run / "samples.csv", samples);
  write(run / "run.yaml", text_of(first / "run.yaml"));
  return run;
}

void read_back(const fs::path& directory) {
  const RunRecord run = read_run(directory);
  const std::unique_ptr<CommandSource> script = script_of(run);
  replay(run, make_model_parts(run.control), script.get());
  behaviour_of_run(directory);
}

/// The search for mistakes is what `diagnose` and `identify` begin with.
void use_as_data(const Measurement& data, const Plant& plant) {
  find_mistakes({data}, plant);
}

TEST(RecordedMutants, OfRuns) {
  const Folder folder;
  const fs::path run = make_run(folder.path(), short_experiments()[3], 20'000);
  const std::string yaml = text_of(run / "run.yaml");
  feed({"run.yaml", {yaml}, "run/run.yaml"}, folder, mutants(), [&](const fs::path&) { read_back(run); });
}

TEST(RecordedMutants, OfSamples) {
  const Folder folder;
  const Plant plant = read_plant_file(config / "plants" / "exponential.yaml");
  const fs::path run = make_run(folder.path(), short_experiments()[3], 20'000);
  const std::string samples = text_of(run / "samples.csv");
  feed({"samples.csv", {samples}, "run/samples.csv"}, folder, mutants(), [&](const fs::path&) {
    read_back(run);
    use_as_data(read_measurement(run), plant);
  });
}

TEST(RecordedMutants, OfRunsThatAreReported) {
  const Folder folder;
  const QuickGnuplot quick(folder.path());
  const fs::path run = make_run(folder.path(), short_experiments()[8], 60'000);
  const std::string yaml = text_of(run / "run.yaml"), samples = text_of(run / "samples.csv");
  feed({"reported yaml", {yaml}, "run/run.yaml"}, folder, mutants() / 2 + 1,
       [&](const fs::path&) { write_run_report(run); });
  write(run / "run.yaml", yaml);
  feed({"reported rows", {samples}, "run/samples.csv"}, folder, mutants() / 2 + 1,
       [&](const fs::path&) { write_run_report(run); });
}

TEST(RecordedMutants, OfExperimentFolders) {
  const Folder folder;
  const QuickGnuplot quick(folder.path());
  const fs::path made = make_experiment(folder.path(), short_experiments()[10]);
  const std::string record = text_of(made / "experiment.yaml"), journal = text_of(made / "trials.csv"),
                    planned = text_of(made / "plan_plant.yaml");
  const ExperimentSetup setup = setup_of(folder.path() / "experiments" / "short.yaml");
  const std::vector<Piece> pieces = plan_pieces(setup);
  const auto go_on = [&] {
    const std::vector<TrialResult> trials = read_trials(made, setup, pieces);
    next_trial(pieces, trials);
    missing_transitions(pieces, trials);
  };
  feed({"record", {record}, "made/experiment.yaml"}, folder, mutants(), [&](const fs::path&) { go_on(); });
  feed({"reported record", {record}, "made/experiment.yaml", longest_motion_s}, folder, mutants() / 20 + 1,
       [&](const fs::path&) { write_experiment_report(made); });
  write(made / "experiment.yaml", record);
  feed({"trials.csv", {journal}, "made/trials.csv"}, folder, mutants(), [&](const fs::path&) { go_on(); });
  feed({"reported trials", {journal}, "made/trials.csv", longest_motion_s}, folder, mutants() / 20 + 1,
       [&](const fs::path&) { write_experiment_report(made); });
  write(made / "trials.csv", journal);
  feed({"planned plant", {planned}, "made/plan_plant.yaml", longest_motion_s}, folder, mutants() / 20 + 1,
       [&](const fs::path&) { write_experiment_report(made); });
}

/// What a call refuses with; empty: it refused nothing.
std::string refusal_of(const std::function<void()>& what) {
  try {
    what();
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

TEST(ExperimentFolder, RefusesTrialsOfAnImpossibleDelayOrFolder) {
  const Folder folder;
  const fs::path made = make_experiment(folder.path(), short_experiments()[10]);
  const std::string journal = text_of(made / "trials.csv");
  const std::string run = read_trials(made).at(0).run_directory, delay = ",0,0.0," + run;
  ASSERT_NE(journal.find(delay), std::string::npos) << journal;
  const auto changed_to = [&](const std::string& cells) {
    std::string text = journal;
    write(made / "trials.csv", text.replace(text.find(delay), delay.size(), cells));
  };
  for (const std::string& cells : {",0,2e6," + run, ",0,-0.001," + run, std::string(",0,0.0,"),
                                   std::string(",0,0.0,.."), ",0,0.0,../" + run}) {
    changed_to(cells);
    EXPECT_NE(
        refusal_of([&] { write_experiment_report(made); }).find("trials.csv:2: this line is not a trial"),
        std::string::npos)
        << cells;
  }
}

TEST(ExperimentFolder, NamesThePlantFileThatCannotBeAnalysed) {
  const Folder folder;
  const QuickGnuplot quick(folder.path());
  const fs::path made = make_experiment(folder.path(), short_experiments()[10]);
  Plant plant = read_plant_file(made / "plan_plant.yaml");
  plant.motor.back_emf_n_per_mps = 1e300;
  write_plant_file(plant, made / "plan_plant.yaml", {});
  const std::string refusal = refusal_of([&] { write_experiment_report(made); });
  EXPECT_NE(refusal.find((made / "plan_plant.yaml").string()), std::string::npos) << refusal;
}

TEST(DiagnosisFolder, NamesTheFileWhoseVerdictIsUnknown) {
  const Folder folder;
  write(folder.path() / "diagnosis.json", "{\"verdict\": \"eXplained\"}");
  const std::string refusal = refusal_of([&] { write_diagnosis_report(folder.path()); });
  EXPECT_TRUE(refusal.starts_with((folder.path() / "diagnosis.json").string() + " has an unknown verdict"))
      << refusal;
}

TEST(RecordedMutants, OfSignRecords) {
  const Folder folder;
  RigFile rig = read_rig_file(config / "rigs" / "modbus-tcp.yaml");
  rig.file = folder.path() / "rig.yaml";
  write_sign_record(rig, "a test");
  const std::string good = text_of(sign_record_of(rig));
  feed({"signs", {good}, "rig.yaml.signs"}, folder, mutants(), [&](const fs::path& file) {
    // Only the first line is free.
    const std::string text = text_of(file);
    const bool same =
        text.find('\n') != std::string::npos && text.substr(text.find('\n')) == good.substr(good.find('\n'));
    EXPECT_EQ(signs_are_checked(rig), same) << current_mutant();
  });
}

/// A table of 200 rows: the same motion as the world writes it.
std::string table(const std::string& delimiter, char decimal, const std::string& units = "") {
  std::string text = "t" + delimiter + "qm" + delimiter + "angle" + delimiter + "vir\n" + units;
  const auto number = [&](double value) {
    std::string cell = exact_text(value);
    std::replace(cell.begin(), cell.end(), '.', decimal);
    return cell;
  };
  for (int k = 0; k < 200; ++k)
    text += number(0.002 * k) + delimiter + number(1e-5 * std::round(2e3 * std::sin(0.05 * k))) + delimiter +
            number(180.0 + std::round(30.0 * std::cos(0.04 * k))) + delimiter +
            number(k % 40 < 20 ? 2.0 : -2.0) + "\n";
  return text;
}

/// With cells that hold nothing.
std::string with_gaps(std::string text) {
  for (std::size_t at = text.size() / 4, i = 0; i < 5; ++i, at += text.size() / 8) {
    const std::size_t begin = text.find(',', at) + 1, end = text.find_first_of(",\n", begin);
    text.replace(begin, end - begin, i % 2 == 0 ? "" : "NaN");
  }
  return text;
}

std::string in_utf16(const std::string& text) {
  std::string wide = "\xff\xfe";
  for (const char c : text) (wide += c) += '\0';
  return wide;
}

std::string with_carriage_returns(const std::string& text) {
  std::string lines;
  for (const char c : text) lines += c == '\n' ? "\r\n" : std::string(1, c);
  return lines;
}

std::vector<std::string> tables() {
  const std::string plain = table(",", '.');
  return {plain,
          plain,
          table(";", ','),
          table("\t", '.', "s\tm\tdeg\tV\n"),
          table(";", ',', "[s];[m];[deg];[V]\n"),
          "\xef\xbb\xbf" + plain,
          in_utf16(plain),
          with_gaps(plain),
          with_carriage_returns(plain)};
}

const std::vector<std::string> datasets = {
    "dataset:\n  file: measured.csv\n  columns: {time_s: t, cart_m: qm, voltage_v: {column: vir, scale: 1.0, "
    "offset: 0.0}}\n",
    "dataset:\n  file: measured.csv\n  columns:\n    time_s: t\n    theta_rad: {column: angle, scale: "
    "0.0174533}\n    voltage_v: vir\n  resolution: {theta_rad: 0.0174533}\n  cart_locked: true\n",
    "dataset:\n  file: measured.csv\n  header: true\n  from_s: 0.01\n  to_s: 0.3\n  missing: stop\n  "
    "columns: "
    "{time_s: t, cart_m: qm, theta_rad: angle, voltage_v: vir}\n  resolution: {cart_m: 1.0e-5}\n"};

TEST(RecordedMutants, OfDatasets) {
  const Folder folder;
  const Plant plant = read_plant_file(config / "plants" / "exponential.yaml");
  write(folder.path() / "measured.csv", tables().front());
  feed({"dataset", datasets, "dataset.yaml"}, folder, mutants(),
       [&](const fs::path& file) { use_as_data(read_measurement(file), plant); });
}

TEST(RecordedMutants, OfForeignTables) {
  const Folder folder;
  const Plant plant = read_plant_file(config / "plants" / "exponential.yaml");
  write(folder.path() / "dataset.yaml", datasets[0]);
  feed({"its table", tables(), "measured.csv"}, folder, mutants(),
       [&](const fs::path&) { use_as_data(read_measurement(folder.path() / "dataset.yaml"), plant); });
  std::vector<std::string> plain = tables();
  for (std::string& text : plain)
    if (text.starts_with("t,"))
      text.replace(0, text.find_first_of("\r\n"), "time_s,cart_m,theta_rad,voltage_v");
  feed({"plain table", plain, "plain.csv"}, folder, mutants(),
       [&](const fs::path& file) { use_as_data(read_measurement(file), plant); });
}

SweepConfig short_sweep(const fs::path& folder) {
  const fs::path file = folder / "sweep-file.yaml";
  write(file, "sweep:\n  plant: " + (config / "plants/exponential.yaml").string() +
                  "\n  gains: " + (config / "gains/exponential.yaml").string() +
                  "\n  loop: continuous\n  theta0_deg: [1.0, 2.0]\n  delay_s: [0.0, 0.01, 0.02, 0.04]\n  "
                  "duration_s: 0.5\n  outcome: {stable_below_rad: 0.0016, fell_above_rad: 1.0}\n  engine: "
                  "fast\n  uncertainty: {percent: 5, samples: 3, seed: 1}\n");
  return read_sweep_file(file);
}

TEST(RecordedMutants, OfSweepResults) {
  const Folder folder;
  const QuickGnuplot quick(folder.path());
  const SweepConfig sweep = short_sweep(folder.path());
  const auto executor = make_thread_executor(sweep, 1);
  const fs::path done = folder.path() / "done";
  run_sweep(sweep, done, {}, *executor);
  for (const char* name : {"sweep.csv", "transitions.csv", "margins.csv", "uncertainty.csv", "sweep.yaml"}) {
    const std::string good = text_of(done / name);
    feed({name, {good}, std::string("done/") + name}, folder, mutants() / 4 + 1,
         [&](const fs::path&) { write_sweep_report(done); });
    write(done / name, good);
  }
}

/// The journal of a sweep whose last line was never written.
std::string journal_of(const SweepConfig& sweep, const fs::path& folder, SweepExecutor& executor) {
  SweepOptions options;
  std::string journal;
  options.progress = [&](std::size_t, std::size_t) { journal = text_of(folder / "sweep.partial"); };
  run_sweep(sweep, folder, options, executor);
  return journal;
}

TEST(RecordedMutants, OfSweepJournals) {
  const Folder folder;
  const SweepConfig sweep = short_sweep(folder.path());
  const auto executor = make_thread_executor(sweep, 1);
  const std::string journal = journal_of(sweep, folder.path() / "whole", *executor);
  const fs::path done = folder.path() / "done";
  feed({"journal", {journal}, "done/sweep.partial"}, folder, mutants(), [&](const fs::path&) {
    run_sweep(sweep, done, {}, *executor);
    fs::remove_all(done);
    fs::create_directory(done);
  });
}

std::string diagnosis() {
  using Json = nlohmann::json;
  const Json effect = {
      {"kind", "coulomb_friction"},
      {"gap_before", 16.8},
      {"gap_after", 1.0},
      {"parameters", {{"level_n", {{"value", 0.43}, {"ci95", {0.42, 0.44}}, {"unit", "N"}}}}},
      {"confusable_with", {"position_dependent_friction"}},
      {"where", "the residual force goes with the direction of motion"}};
  return Json{{"verdict", "explained"},
              {"gap", {{"before", 1492.3}, {"after", 1.0}}},
              {"effects", {effect}},
              {"candidates", {{{"kind", "coulomb_friction"}, {"evidence", 11061.4}, {"gap_after", 1.0}}}},
              {"trials",
               {{{"round", 1},
                 {"kind", "coulomb_friction"},
                 {"evidence", 11061.4},
                 {"held_out", -7512.1},
                 {"t", 12.3},
                 {"standard_errors", 1e9},
                 {"taken", true}}}},
              {"residual", "what is left is the sensors' own noise"},
              {"next_experiment", nullptr},
              {"notes", {"a note"}}}
      .dump(1);
}

TEST(RecordedMutants, OfDiagnoses) {
  const Folder folder;
  const QuickGnuplot quick(folder.path());
  const fs::path made = folder.path() / "diagnosis";
  fs::create_directory(made);
  std::string traces = "segment,run,time_s,voltage_v,cart_m,before,after,theta_rad,before,after\n";
  std::string residuals =
      "run,segment,time_s,cart_m,cart_mps,voltage_v,force,force_after,torque,torque_after\n";
  for (int i = 0; i < 60; ++i) {
    const std::string time = exact_text(0.01 * i), value = exact_text(std::sin(0.1 * i));
    traces += "0,a-run," + time + ",1," + value + "," + value + ",0.1," + value + ",0.2," + value + "\n";
    residuals += "0,0," + time + "," + value + ",0.1,1," + value + ",0.2," + value + ",0.1\n";
  }
  const std::string plant = text_of(config / "plants" / "exponential.yaml");
  const std::vector<std::pair<std::string, std::string>> files = {{"diagnosis.json", diagnosis()},
                                                                  {"traces.csv", traces},
                                                                  {"residuals.csv", residuals},
                                                                  {"given.yaml", plant},
                                                                  {"model.yaml", plant}};
  for (const auto& [name, text] : files) write(made / name, text);
  for (const auto& [name, text] : files) {
    feed({name.c_str(), {text}, "diagnosis/" + name}, folder, mutants() / 4 + 1,
         [&](const fs::path&) { write_diagnosis_report(made); });
    write(made / name, text);
  }
}

}  // namespace
}  // namespace upright::testing
