// `upright diagnose`: where model and data disagree, which effect is missing, the model with it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "diagnosis/described_curve.hpp"
#include "diagnosis/diagnosis_json.hpp"
#include "diagnosis/motion_range.hpp"
#include "diagnosis/plain_words.hpp"
#include "diagnosis/simulated_segments.hpp"
#include "diagnosis/validation.hpp"
#include "experiment_data.hpp"
#include "measurement/data_check.hpp"
#include "measurement/long_records.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "result_folder.hpp"
#include "signals.hpp"
#include "upright/base/error.hpp"
#include "upright/diagnosis/diagnosis.hpp"
#include "upright/model/plant_file.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;

struct DiagnoseFlags {
  std::string model;
  std::vector<std::string> data;
  std::vector<std::string> validate;
  std::string out;
  bool as_json = false;
  bool trials = false;
  bool trust_data = false;
  bool quick = false;
  double effort = default_search_bound;
};

std::string in_words(const ParameterEstimate& p) {
  char text[160];
  std::snprintf(text, sizeof text, "%s = %.5g %s (95%%: %.5g to %.5g)", p.name.c_str(), p.value,
                p.unit.c_str(), p.low, p.high);
  return text;
}

/// The parameters of an effect, or the curve that describes a force.
void print_parameters(const FoundEffect& effect) {
  const auto curve = described_curve(effect);
  if (!curve) {
    for (const ParameterEstimate& p : effect.parameters) std::printf("      %s\n", in_words(p).c_str());
    return;
  }
  std::printf("      over %s:\n", curve->over.c_str());
  for (std::size_t i = 0; i < curve->at.size(); ++i)
    std::printf("      %10.4g %-4s %10.4g (95%%: %.4g to %.4g)\n", curve->at[i], curve->unit.c_str(),
                curve->force_n[i], curve->low_n[i], curve->high_n[i]);
}

/// In a line, without intervals.
void print_values(const std::vector<ParameterEstimate>& parameters) {
  for (const ParameterEstimate& p : parameters)
    std::printf(" %s %.4g %s", p.name.c_str(), p.value, p.unit.c_str());
}

/// How the search came to its answer, where it did not only add one effect after the other.
void print_steps(const Diagnosis& d) {
  const auto lost = [&](const Step::Effect& had) {
    return std::none_of(d.effects.begin(), d.effects.end(),
                        [&](const FoundEffect& found) { return found.effect == had.effect; });
  };
  if (std::none_of(d.steps.begin(), d.steps.end(), [&](const Step& step) {
        return std::any_of(step.effects.begin(), step.effects.end(), lost);
      }))
    return;
  std::printf("Steps of the search (--trials lists every fit):\n");
  for (std::size_t i = 0; i < d.steps.size(); ++i) {
    std::printf("  %zu.", i + 1);
    for (const Step::Effect& effect : d.steps[i].effects) {
      std::printf(" %s", kind_of(effect.effect).c_str());
      print_values(effect.parameters);
      std::printf(";");
    }
    std::printf("\n");
  }
}

void print_next_best(const NextBest& best) {
  for (const Trial* other : best.others) {
    std::printf("      next best candidate: %s, evidence %.4g against %.4g:", kind_of(other->effect).c_str(),
                other->evidence, best.taken->evidence);
    print_values(other->parameters);
    std::printf("\n");
  }
}

void print_verdict(const Diagnosis& d) {
  if (d.interrupted)
    std::printf("INTERRUPTED: the search is not finished. %s\n",
                d.examined ? "The effects below were tested, but alternatives were not."
                           : "This is the best answer so far. It was not tested.");
  if (d.bound_reached)
    std::printf("SEARCH BOUND REACHED: the search is not finished. %s\n",
                d.examined
                    ? "The effects below were tested. To search longer, raise --effort."
                    : "This is the best answer so far. It was not tested. To search longer, raise --effort.");
  if (!d.not_examined.empty()) {
    std::string all;
    for (const std::string& each : d.not_examined) all += (all.empty() ? "" : ", ") + each;
    std::printf("QUICK: only what is certain is named. Not examined: %s.\n", all.c_str());
  }
  if (!d.examined) return;
  switch (d.verdict) {
    case Verdict::explained:
      std::printf("Explained: with the %s below, the model explains the data.\n",
                  d.effects.empty() ? "numbers" : "effects");
      break;
    case Verdict::no_discrepancy:
      std::printf("No discrepancy: the model agrees with the data.\n");
      break;
    case Verdict::unexplained:
      std::printf("Unexplained: the model lacks something that no known effect explains.\n");
      break;
    case Verdict::described:
      std::printf(
          "Described, not explained: no known effect accounts for the data. The missing force is a curve.\n");
      break;
    case Verdict::not_excited:
      std::printf("Not excited: these data could not show what the model may lack.\n");
      break;
  }
}

std::string gap_text(double gap) {
  if (!std::isfinite(gap)) return "not measured";
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", gap);
  return text;
}

/// On which runs an effect shows, and in which stretch most.
void print_shown(const Diagnosis& d, const FoundEffect& effect) {
  if (effect.shown_on.empty()) return;
  std::printf("      shown by");
  for (const RunEvidence& of : effect.shown_on)
    std::printf(" %s (%.0f %%)%s", d.run_names[of.run].c_str(), 100.0 * share_of(of, effect.shown_on),
                &of == &effect.shown_on.back() ? "" : ",");
  std::printf("; most in %s from %.4g to %.4g s\n", d.run_names[effect.shows_most.run].c_str(),
              effect.shows_most.from_s, effect.shows_most.to_s);
}

void print_local(const Diagnosis& d) {
  if (d.helps_here_only.empty()) return;
  std::printf("Helps only on a part of the data (not in the model):\n");
  for (const LocalEffect& local : d.helps_here_only) {
    std::printf("  %-28s", kind_of(local.effect).c_str());
    print_values(local.parameters);
    std::printf("\n      %s\n", local.where.c_str());
  }
}

void print_numbers(const Diagnosis& d) {
  if (d.numbers.empty()) return;
  std::printf("Numbers of the plant file that moved:\n");
  std::printf("  %-44s %12s %12s   %s\n", "number", "file", "fitted", "believed within");
  for (const MovedNumber& n : d.numbers) {
    const bool outside = n.fitted < n.low || n.fitted > n.high;
    std::printf("  %-44s %12.5g %12.5g   %.5g to %.5g %s%s\n", n.name.c_str(), n.file, n.fitted, n.low,
                n.high, n.unit.c_str(), outside ? " (outside)" : "");
  }
}

/// What the data would have shown, where the answer is that nothing was found.
void print_power(const Diagnosis& d) {
  if (d.verdict != Verdict::no_discrepancy && d.verdict != Verdict::not_excited) return;
  for (const Detectable& each : d.detectable)
    std::printf("%s%s above %.2g %s%s",
                &each == &d.detectable.front() ? "These data would have shown: " : ", ",
                kind_of(each.effect).c_str(), each.size,
                std::string(effect_registry()[each.effect].parameters[0].unit).c_str(),
                &each == &d.detectable.back() ? ".\n" : "");
}

std::string score_text(const ModelScore& score) {
  char text[96];
  std::string all = "gap " + gap_text(score.gap);
  if (std::isfinite(score.cart_rmse_m)) {
    std::snprintf(text, sizeof text, ", %.4g m", score.cart_rmse_m);
    all += text;
  }
  if (std::isfinite(score.theta_rmse_rad)) {
    std::snprintf(text, sizeof text, ", %.4g rad", score.theta_rmse_rad);
    all += text;
  }
  return all;
}

void print_validation(const Diagnosis& d) {
  if (d.validation.empty()) return;
  std::printf("Validation on runs that were not fitted (open-loop simulation: gap, RMS error):\n");
  for (const ValidatedRun& run : d.validation) {
    std::printf("  %s: %s as given; %s with the model found%s\n", run.name.c_str(),
                score_text(run.given).c_str(), score_text(run.found).c_str(),
                run.is_worse() ? ". WORSE: the model found is further off than the one given" : "");
    if (!run.beyond.empty())
      std::printf("      beyond the measured range, where the model is not tested: %s\n",
                  range_text(run.beyond).c_str());
  }
}

/// Where the model is tested.
void print_range(const Diagnosis& d) {
  if (d.measured_range.empty()) return;
  std::printf("Measured range, beyond which the model is not tested: %s.\n",
              range_text(d.measured_range).c_str());
}

void print(const Diagnosis& d, const std::string& out) {
  print_verdict(d);
  std::printf("Gap (open-loop error on held-out data / noise floor): %s before, %s after.\n",
              gap_text(d.gap_before).c_str(), gap_text(d.gap_after).c_str());
  for (const FoundEffect& effect : d.effects) {
    std::printf("  %-28s", kind_of(effect.effect).c_str());
    if (d.examined)
      std::printf(" gap %s -> %s", gap_text(effect.gap_before).c_str(), gap_text(effect.gap_after).c_str());
    std::printf("\n");
    print_parameters(effect);
    if (!effect.where.empty()) std::printf("      %s\n", in_plain_words(effect.where).c_str());
    if (!effect.indistinguishable_from.empty()) {
      std::string names;
      for (const std::size_t other : effect.indistinguishable_from)
        names += (names.empty() ? "" : ", ") + kind_of(other);
      std::printf("      these data do not distinguish it from: %s\n", names.c_str());
    }
    print_shown(d, effect);
    print_next_best(next_best(d, effect));
  }
  print_local(d);
  print_numbers(d);
  print_range(d);
  print_validation(d);
  print_steps(d);
  std::printf("Residual tests: %s.\n", in_plain_words(d.residual).c_str());
  print_power(d);
  if (d.next_experiment)
    std::printf("Next experiment, to distinguish them: upright experiment %s --rig RIG\n  %s\n",
                d.next_experiment->file.c_str(), d.next_experiment->description.c_str());
  for (const std::string& note : d.notes) std::printf("Note: %s.\n", in_plain_words(note).c_str());
  if (!out.empty()) std::printf("Written: %s\n", out.c_str());
}

/// Why each effect was taken or not.
void print_trials(const Diagnosis& d) {
  for (const Trial& trial : d.trials) {
    std::printf("%s round %zu  %-28s evidence %.1f, held out %.1f, t %.1f, %.1f standard errors;",
                trial.taken ? "+" : " ", trial.round + 1, kind_of(trial.effect).c_str(), trial.evidence,
                trial.held, trial.t_value, trial.certainty);
    for (const ParameterEstimate& p : trial.parameters) std::printf(" %s %.5g", p.name.c_str(), p.value);
    std::printf("; noise %.3g N, %.3g N m, %.2g s, x%.3g; rule %s\n", trial.noise.force, trial.noise.torque,
                trial.noise.jitter_s, trial.noise.sensors, trial.rule.c_str());
  }
}

std::vector<std::string> provenance(const Diagnosis& d, const DiagnoseFlags& flags) {
  std::vector<std::string> lines = {"Diagnosed from " + flags.model + " by upright " UPRIGHT_VERSION "."};
  for (const std::string& data : flags.data) lines.push_back("data: " + data);
  if (!d.measured_range.empty())
    lines.push_back("The model is not tested beyond the measured range: " + range_text(d.measured_range) +
                    ".");
  if (!d.examined) lines.emplace_back("The search was not finished: nothing says that this model is right.");
  for (const FoundEffect& effect : d.effects) {
    char text[200];
    std::snprintf(text, sizeof text, "added %s: gap %.3g -> %.3g", kind_of(effect.effect).c_str(),
                  effect.gap_before, effect.gap_after);
    lines.emplace_back(text);
  }
  return lines;
}

/// The residual force and torque on held-out data, before and after, thinned to what a plot can show.
void write_residuals(const Diagnosis& d, std::ostream& out) {
  constexpr std::size_t max_rows = 6000;
  std::size_t count = 0;
  for (const ResidualTrace& trace : d.residual_before) count += trace.time_s.size();
  const std::size_t stride = 1 + count / max_rows;
  out << "segment,run,time_s,cart_m,cart_velocity_mps,voltage_v,force_before_n,force_after_n,torque_before_"
         "nm,torque_after_nm\n";
  for (std::size_t s = 0; s < d.residual_before.size(); ++s) {
    const ResidualTrace& before = d.residual_before[s];
    const ResidualTrace& after = d.residual_after[s];
    for (std::size_t k = 0; k < before.time_s.size(); k += stride) {
      out << s << ',' << before.run;
      for (const double value :
           {before.time_s[k], before.cart_m[k], before.cart_mps[k], before.voltage_v[k], before.force_n[k],
            after.force_n[k], before.torque_nm[k], after.torque_nm[k]})
        out << ',' << exact_text(value);
      out << '\n';
    }
  }
}

/// Measured and simulated on held-out segments, with the plant file as given and with the model that was
/// found. A cell is empty where there is nothing measured.
void write_traces(const Diagnosis& d, const Plant& given, const std::vector<Measurement>& runs,
                  std::ostream& out) {
  constexpr std::size_t max_rows = 20000;
  const std::vector<Segment> segments = held_out_segments(d, runs);
  const std::vector<SimulatedSegment> before = simulate_segments(given, runs, segments);
  const std::vector<SimulatedSegment> after = simulate_segments(d.model, runs, segments);
  std::size_t count = 0;
  for (const SimulatedSegment& trace : before) count += trace.time_s.size();
  const std::size_t stride = 1 + count / max_rows;
  out << "segment,run,time_s,voltage_v,cart_m,cart_before_m,cart_after_m,theta_rad,theta_before_rad,theta_"
         "after_rad\n";
  const auto cell = [&](const std::vector<double>& values, std::size_t k) {
    out << ',';
    if (k < values.size()) out << exact_text(values[k]);
  };
  for (std::size_t s = 0; s < before.size(); ++s) {
    for (std::size_t k = 0; k < before[s].time_s.size(); k += stride) {
      std::string name = runs[before[s].run].name;
      std::replace(name.begin(), name.end(), ',', '_');
      out << s << ',' << name;
      for (const auto* values :
           {&before[s].time_s, &before[s].voltage_v, &before[s].cart_m, &before[s].simulated_cart_m,
            &after[s].simulated_cart_m, &before[s].theta_rad, &before[s].simulated_theta_rad,
            &after[s].simulated_theta_rad})
        cell(*values, k);
      out << '\n';
    }
  }
}

/// The 95 percent intervals of the found effects' parameters. None ends at an open end of its range, which a
/// plant file cannot have.
std::vector<NumberInterval> intervals_of(const Diagnosis& d) {
  constexpr double above_open_end = 1e-3;  // of the distance from the value, which is allowed
  std::vector<NumberInterval> intervals;
  for (const FoundEffect& effect : d.effects)
    for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
      const ParameterEstimate& p = effect.parameters[i];
      if (!(std::isfinite(p.low) && std::isfinite(p.high) && p.low < p.high)) continue;
      const Range& range = effect_registry()[effect.effect].parameters[i].range;
      const bool ends_open = range.low_open && p.low <= range.low;
      intervals.push_back({kind_of(effect.effect) + "." + p.name,
                           ends_open ? range.low + above_open_end * (p.value - range.low) : p.low, p.high});
    }
  return intervals;
}

void write_results(const Diagnosis& d, const Plant& given, const std::vector<Measurement>& runs,
                   const DiagnoseFlags& flags) {
  create_result_folder(flags.out);
  write_plant_file(d.model, fs::path(flags.out) / "model.yaml", provenance(d, flags), intervals_of(d));
  write_plant_file(given, fs::path(flags.out) / "given.yaml", {"The plant file as given: " + flags.model});
  const fs::path folder = flags.out;
  write_result(folder / "residuals.csv", [&](std::ostream& out) { write_residuals(d, out); });
  write_result(folder / "traces.csv", [&](std::ostream& out) { write_traces(d, given, runs, out); });
  write_result(folder / "diagnosis.json", [&](std::ostream& out) { out << diagnosis_json(d) << "\n"; });
}

/// Runs that are simulated only. They are read as strictly as the others.
std::vector<Measurement> validation_runs(const DiagnoseFlags& flags, const Plant& plant) {
  if (flags.validate.empty()) return {};
  const std::vector<Measurement> runs = read_measurements(runs_named(flags.validate).runs);
  if (!flags.trust_data) refuse_mistakes(runs, plant);
  return runs;
}

ExitCode run_diagnose(const DiagnoseFlags& flags) {
  end_on_signal();
  Progress progress("reading the data");
  const Plant plant = read_plant_file(flags.model);
  const NamedRuns named = runs_named(flags.data);
  std::vector<Measurement> runs = read_measurements(named.runs);
  if (!flags.trust_data) refuse_mistakes(runs, plant);
  runs = within_samples(std::move(runs), max_diagnosed_samples);
  const std::vector<Measurement> unseen = validation_runs(flags, plant);
  if (!flags.out.empty() && fs::exists(fs::path(flags.out) / "diagnosis.json"))
    throw ConfigError(flags.out + " already holds a diagnosis: choose another folder with --out");
  DiagnosisOptions options;
  options.signal = &answer_on_signal();
  options.search_bound = flags.effort;
  options.quick = flags.quick;
  progress.begin("diagnose");
  options.progress = [&](double share, const std::string& what) { progress.report_search(share, what); };
  Diagnosis diagnosis = diagnose(plant, runs, options);
  diagnosis.notes.insert(diagnosis.notes.begin(), named.left_out.begin(), named.left_out.end());
  if (!unseen.empty()) {
    progress.begin("validation");
    diagnosis.validation = validate(plant, diagnosis, unseen);
  }
  progress.begin("writing the results");
  if (!flags.out.empty()) write_results(diagnosis, plant, runs, flags);
  progress.end();
  if (flags.as_json) {
    std::cout << diagnosis_json(diagnosis) << "\n";
  } else {
    if (flags.trials) print_trials(diagnosis);
    print(diagnosis, flags.out);
    std::fflush(stdout);
  }
  finish_output();
  return diagnosis.interrupted ? ExitCode::stopped : ExitCode::done;
}

}  // namespace

void add_diagnose(CommandLine& line) {
  const Command command = line.command(
      "diagnose", "Find the effects that a plant model lacks, from measured runs",
      "Example:  upright diagnose --model config/plants/viscous.yaml --data runs/a runs/b --out diagnosis\n"
      "Ctrl-C stops the search and gives the best answer so far, with exit code 3. A second Ctrl-C ends the\n"
      "program at once.");
  const auto flags = std::make_shared<DiagnoseFlags>();
  command.option("--model", flags->model, "Plant file: the model to test against the data").required();
  command
      .option("--data", flags->data,
              "Measured runs: experiment folders, run directories, CSV or dataset files")
      .required();
  command.option("--validate", flags->validate,
                 "Runs that are not fitted: the models as given and as found are scored on them");
  command.option("--out", flags->out,
                 "Folder for the results: diagnosis.json, the improved model.yaml, and CSV files");
  command.flag(
      "--quick", flags->quick,
      "Name only what is certain, in about a tenth of the time; the answer says what was not examined");
  command.flag("--trust-data", flags->trust_data,
               "Continue even if signs, zeros or units of the data contradict the plant file");
  command.flag("--trials", flags->trials, "List every fit of the search; + marks those that were accepted");
  command
      .option("--effort", flags->effort,
              "Search bound: number of passes over the data after which the search stops with the best "
              "answer so far (default: 10000)")
      .in(Range::positive());
  command.flag("--json", flags->as_json, "Print one JSON document");
  command.does([flags] { return run_diagnose(*flags); });
}

}  // namespace upright::cli
