#include "run_data.hpp"

#include <array>
#include <deque>

#include "base/input_file.hpp"
#include "row_thinner.hpp"
#include "upright/record/run_reader.hpp"

namespace upright {

namespace {

double seconds_of(const LogRecord& row) {
  return 1e-9 * static_cast<double>(row.time_ns);
}

std::string seconds(double value) {
  return number_text(value) + " s";
}

std::string yes(bool value) {
  return value ? "yes" : "no";
}

/// A scalar of a map as text; empty if the key is missing.
std::string plain(const std::optional<YamlMap>& map, const std::string& key) {
  return map && map->is_scalar(key) ? map->text_or(key, "") : "";
}

/// Text as a sentence: with a capital letter at the beginning and a full stop at the end.
std::string sentence(std::string text) {
  if (text.empty()) return text;
  if (text.front() >= 'a' && text.front() <= 'z') text.front() = static_cast<char>(text.front() - 'a' + 'A');
  if (text.back() != '.') text += '.';
  return text;
}

void tell_outcome(const RunRecord& record, RunData& data) {
  const double end_s = data.closing.empty() ? 0.0 : seconds_of(data.closing.back());
  if (!record.outcome) {
    data.tone = Tone::warning;
    data.headline = "Cut short after " + seconds(end_s);
    data.reason =
        "The run wrote no outcome: it is still in progress, was killed, or the power failed. All rows that "
        "it "
        "wrote are shown.";
    return;
  }
  const std::string result = plain(record.outcome, "result");
  const double time_s = record.outcome->number_or("time_s", end_s);
  data.reason = sentence(plain(record.outcome, "sentence"));
  if (result == "completed") {
    data.tone = Tone::good;
    data.headline = "Stayed upright for " + seconds(time_s);
  } else {
    data.tone = Tone::bad;
    const bool at_zero = plain(record.outcome, "zero_volts") == "confirmed";
    const char* stopped = at_zero ? "Stopped at zero volts after " : "Stopped after ";
    data.headline = (result == "fell" ? "Fell after " : stopped) + seconds(time_s);
  }
  const std::string zero = plain(record.outcome, "zero_volts_sentence");
  const bool unconfirmed = plain(record.outcome, "zero_volts") == "not_confirmed" ||
                           plain(record.outcome, "amplifier_disabled") == "false";
  if (!zero.empty()) data.outcome_facts.emplace_back("output at the end", zero);
  if (!unconfirmed) return;
  data.tone = Tone::bad;
  data.reason = sentence(zero) + " " + data.reason;
}

/// An event in the flags of rows, and how often it occurred.
struct Event {
  const char* name;
  std::uint32_t flags;
  std::uint64_t rows = 0;
};

using Events = std::array<Event, 8>;

Events events() {
  return {{{"periods at the voltage limit", row_flag::saturated},
           {"overruns due to late wake-up", row_flag::overrun_wake},
           {"overruns due to reading", row_flag::overrun_read},
           {"overruns due to computing", row_flag::overrun_compute},
           {"overruns due to writing", row_flag::overrun_write},
           {"rows after missed periods", row_flag::missed},
           {"rows without new counts", row_flag::held},
           {"failed writes", row_flag::write_failed}}};
}

void add_to_statistics(const LogRecord& row, RunData& data) {
  ++data.rows;
  data.theta_rad.add(row.theta_rad);
  data.cart_m.add(row.cart_m);
  data.voltage_requested_v.add(row.voltage_requested_v);
  data.voltage_v.add(row.voltage_v);
  data.wake_late_ns.add(row.wake_late_ns);
  data.read_ns.add(row.read_ns);
  data.compute_ns.add(row.compute_ns);
  data.write_ns.add(row.write_ns);
}

/// Reads all rows once. Returns whether the last line was incomplete.
bool gather_rows(const std::filesystem::path& samples, const ProgressCallback& progress, RunData& data) {
  SampleReader reader(samples);
  RowThinner thinner;
  std::deque<LogRecord> closing;
  Events seen = events();
  double first_s = 0.0;
  constexpr std::uint64_t rows_between_reports = 16384;
  constexpr double reading_share = 0.9;  // of a long run; the rest draws the plots
  for (LogRecord row; reader.next(row); row = {}) {
    if (data.rows == 0) first_s = seconds_of(row);
    add_to_statistics(row, data);
    if (progress && data.rows % rows_between_reports == 0)
      progress(reading_share * reader.share_read(), std::to_string(data.rows) + " rows");
    for (Event& event : seen) event.rows += (row.flags & event.flags) != 0 ? 1 : 0;
    thinner.add(row);
    closing.push_back(row);
    while (seconds_of(closing.front()) < seconds_of(row) - closing_s || closing.size() > RowThinner::max_rows)
      closing.pop_front();
  }
  for (const Event& event : seen) data.outcome_facts.emplace_back(event.name, std::to_string(event.rows));
  data.drawn = thinner.take();
  data.closing.assign(closing.begin(), closing.end());
  if (!closing.empty()) data.duration_s = seconds_of(closing.back()) - first_s;
  return reader.truncated();
}

void gather_warnings(const RunRecord& record, bool truncated, RunData& data) {
  if (data.rows == 0) data.warnings.emplace_back("The log contains no rows.");
  if (truncated) data.warnings.emplace_back("The last line of samples.csv is incomplete and is not shown.");
  const std::string dropped = plain(record.outcome, "rows_dropped");
  if (!dropped.empty() && dropped != "0")
    data.warnings.push_back(dropped + " rows were not logged, because the disk was too slow.");
  const std::string failure = plain(record.outcome, "log_failure");
  if (!failure.empty()) data.warnings.push_back("The log ended early: " + failure + ".");
  const auto loop = record.document.optional_map("loop");
  if (plain(loop, "delay_is_exact") == "false")
    data.warnings.push_back(
        "The delay of " + plain(loop, "delay_periods") +
        " periods is not a whole number, so the state was interpolated linearly between samples.");
}

void gather_provenance(const RunRecord& record, RunData& data) {
  const auto run = record.document.optional_map("run");
  const auto provenance = record.document.optional_map("provenance");
  const auto scheduling = record.document.optional_map("scheduling");
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) data.provenance.emplace_back(name, value);
  };
  add("command", plain(run, "command"));
  add("started (UTC)", record.started_utc);
  add("rig", backends_text(record.rig));
  add("sample rate", number_text(record.control.sample_rate_hz, 6) + " Hz");
  add("delay", number_text(record.control.delay_s, 6) + " s");
  add("seed", plain(run, "seed"));
  add("scheduling", plain(scheduling, "note"));
  add("version", plain(provenance, "version"));
  // Enough to identify it. 40 digits do not fit on a telephone; run.yaml has all of them.
  constexpr std::size_t commit_digits = 12;
  add("git commit", plain(provenance, "git_commit").substr(0, commit_digits));
  if (!plain(provenance, "git_dirty").empty())
    add("uncommitted changes", yes(plain(provenance, "git_dirty") == "true"));
  for (const char* name : {"compiler", "host", "kernel", "machine"}) add(name, plain(provenance, name));
}

}  // namespace

RunData load_run_data(const std::filesystem::path& run_directory, const ProgressCallback& progress) {
  const RunRecord record = read_run_without_samples(run_directory);
  RunData data;
  data.name = std::filesystem::absolute(run_directory / "").parent_path().filename().string();
  data.origin = "started " + record.started_utc + " on the " + backends_text(record.rig) + " rig";
  data.period_s = record.control.period_s();
  data.amplifier_limit_v = record.rig.amplifier.limit_v;
  data.run_yaml = whole_file(run_directory / "run.yaml");
  const bool truncated = gather_rows(run_directory / "samples.csv", progress, data);
  tell_outcome(record, data);
  gather_warnings(record, truncated, data);
  gather_provenance(record, data);
  return data;
}

}  // namespace upright
