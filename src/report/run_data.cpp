#include "run_data.hpp"

#include <fstream>
#include <iterator>

#include "upright/runtime/run_reader.hpp"

namespace upright {

namespace {

std::string seconds(double value) {
  return number_text(value) + " s";
}

std::string yes(bool value) {
  return value ? "yes" : "no";
}

/// A plain value of a map as text; empty when it is not there.
std::string plain(const std::optional<YamlMap>& map, const std::string& key) {
  return map && map->is_scalar(key) ? map->text_or(key, "") : "";
}

/// With a capital at the beginning and a full stop at the end.
std::string sentence(std::string text) {
  if (text.empty()) return text;
  if (text.front() >= 'a' && text.front() <= 'z') text.front() = static_cast<char>(text.front() - 'a' + 'A');
  if (text.back() != '.') text += '.';
  return text;
}

void tell_outcome(const RunRecord& record, RunData& data) {
  const double end_s = data.time_s.empty() ? 0.0 : data.time_s.back();
  if (!record.outcome) {
    data.tone = Tone::warning;
    data.headline = "Cut short after " + seconds(end_s);
    data.reason =
        "The run is still going on, or it was killed or lost its power: no outcome was written. Every row "
        "that "
        "was written is shown.";
    return;
  }
  const std::string result = plain(record.outcome, "result");
  const double time_s = record.outcome->number_or("time_s", end_s);
  data.reason = sentence(plain(record.outcome, "sentence"));
  if (result == "completed") {
    data.tone = Tone::good;
    data.headline = "Stayed up for " + seconds(time_s);
  } else {
    data.tone = Tone::bad;
    data.headline = (result == "fell" ? "Fell after " : "Stopped at zero volts after ") + seconds(time_s);
  }
}

/// Rows of the log with any of the flags.
std::size_t rows_with(const RunRecord& record, std::uint32_t flags) {
  std::size_t count = 0;
  for (const LogRecord& row : record.samples.rows) count += (row.flags & flags) != 0 ? 1 : 0;
  return count;
}

void count_events(const RunRecord& record, RunData& data) {
  const auto add = [&](const char* name, std::uint32_t flags) {
    data.outcome_facts.emplace_back(name, std::to_string(rows_with(record, flags)));
  };
  add("periods at the voltage limit", row_flag::saturated);
  add("overruns by waking late", row_flag::overrun_wake);
  add("overruns by reading", row_flag::overrun_read);
  add("overruns by computing", row_flag::overrun_compute);
  add("overruns by writing", row_flag::overrun_write);
  add("rows after missed periods", row_flag::missed);
  add("rows without fresh counts", row_flag::held);
  add("failed writes", row_flag::write_failed);
}

void gather_warnings(const RunRecord& record, RunData& data) {
  if (data.time_s.empty()) data.warnings.emplace_back("The log holds no row.");
  if (record.samples.truncated)
    data.warnings.emplace_back("The last line of samples.csv was cut; it is left out.");
  const std::string dropped = plain(record.outcome, "rows_dropped");
  if (!dropped.empty() && dropped != "0")
    data.warnings.push_back(dropped + " rows never reached the disk: it was too slow.");
  const std::string failure = plain(record.outcome, "log_failure");
  if (!failure.empty()) data.warnings.push_back("The log ended early: " + failure + ".");
  const auto loop = record.document.optional_map("loop");
  if (plain(loop, "delay_is_exact") == "false")
    data.warnings.push_back("The delay of " + plain(loop, "delay_periods") +
                            " periods is not whole: the state was interpolated linearly between samples.");
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
  add("git commit", plain(provenance, "git_commit"));
  if (!plain(provenance, "git_dirty").empty())
    add("uncommitted changes", yes(plain(provenance, "git_dirty") == "true"));
  for (const char* name : {"compiler", "host", "kernel", "machine"}) add(name, plain(provenance, name));
}

void gather_columns(const std::vector<LogRecord>& rows, RunData& data) {
  constexpr double s_per_ns = 1e-9;
  constexpr double us_per_ns = 1e-3;
  for (const LogRecord& row : rows) {
    data.time_s.push_back(static_cast<double>(row.time_ns) * s_per_ns);
    data.cart_m.push_back(row.cart_m);
    data.theta_rad.push_back(row.theta_rad);
    data.voltage_requested_v.push_back(row.voltage_requested_v);
    data.voltage_v.push_back(row.voltage_v);
    data.wake_late_us.push_back(static_cast<double>(row.wake_late_ns) * us_per_ns);
    data.read_us.push_back(static_cast<double>(row.read_ns) * us_per_ns);
    data.compute_us.push_back(static_cast<double>(row.compute_ns) * us_per_ns);
    data.write_us.push_back(static_cast<double>(row.write_ns) * us_per_ns);
  }
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

RunData load_run_data(const std::filesystem::path& run_directory) {
  const RunRecord record = read_run(run_directory);
  RunData data;
  data.name = std::filesystem::absolute(run_directory / "").parent_path().filename().string();
  data.origin = "started " + record.started_utc + " on the " + backends_text(record.rig) + " rig";
  data.period_s = record.control.period_s();
  data.amplifier_limit_v = record.rig.amplifier.limit_v;
  data.run_yaml = read_text(run_directory / "run.yaml");
  gather_columns(record.samples.rows, data);
  tell_outcome(record, data);
  count_events(record, data);
  gather_warnings(record, data);
  gather_provenance(record, data);
  return data;
}

}  // namespace upright
