#include "run_behaviour.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/control_loop.hpp"
#include "student.hpp"
#include "upright/record/run_reader.hpp"

namespace upright {

namespace {

constexpr double last_part = 1.0 / 3.0;
constexpr double min_window_s = 1.0;  // the cart's hunting takes about a second from jump to jump
constexpr double min_batch_s = 1.0;   // the same: a batch must hold what the next one is to repeat
constexpr std::size_t min_batches = 5, max_batches = 20;
constexpr std::uint64_t min_rows = 20;  // of a window: fewer say nothing of an rms
constexpr double infinity = std::numeric_limits<double>::infinity();

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double variance_of(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0.0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return sum / static_cast<double>(values.size() - 1);
}

/// Correlation of neighbouring batches; that of too few is held where the widening stays below tenfold.
double neighbours_correlation(const std::vector<double>& values) {
  const double mean = mean_of(values), variance = variance_of(values);
  if (!(variance > 0.0)) return 0.0;
  double sum = 0.0;
  for (std::size_t i = 1; i < values.size(); ++i) sum += (values[i] - mean) * (values[i - 1] - mean);
  constexpr double max_correlation = 0.8;
  return std::clamp(sum / (variance * static_cast<double>(values.size() - 1)), 0.0, max_correlation);
}

Estimate root_mean_square(double mean_square, const std::vector<double>& batch_mean_squares) {
  Estimate estimate{std::sqrt(mean_square), {}};
  const std::size_t count = batch_mean_squares.size();
  if (count < min_batches) return estimate;
  const double r = neighbours_correlation(batch_mean_squares);
  const double half = student_quantile(count - 1) * std::sqrt(variance_of(batch_mean_squares) * (1.0 + r) /
                                                              (1.0 - r) / static_cast<double>(count));
  estimate.ci95 = {std::sqrt(std::max(0.0, mean_square - half)), std::sqrt(mean_square + half)};
  return estimate;
}

Estimate peak_to_peak(double value, const std::vector<double>& of_batches) {
  Estimate estimate{value, {}};
  if (of_batches.size() < min_batches) return estimate;
  const double half = student_quantile(of_batches.size() - 1) * std::sqrt(variance_of(of_batches));
  estimate.ci95 = {std::max(0.0, value - half), value + half};
  return estimate;
}

double seconds_of(const LogRecord& row) {
  return 1e-9 * static_cast<double>(row.time_ns);
}

/// The rows that count, from the first to the last.
struct Extent {
  double first_s = infinity, last_s = -infinity;
  bool with_feedback = false;  ///< the log tells when the feedback acts
};

bool counts(const LogRecord& row, bool with_feedback) {
  return (row.flags & row_flag::stopped) == 0 && (!with_feedback || (row.flags & row_flag::feedback) != 0);
}

Extent extent_of(const std::filesystem::path& samples) {
  Extent all, feedback;
  SampleReader reader(samples);
  for (LogRecord row; reader.next(row); row = {})
    for (Extent* extent : {&all, &feedback})
      if (counts(row, extent == &feedback)) {
        extent->first_s = std::min(extent->first_s, seconds_of(row));
        extent->last_s = std::max(extent->last_s, seconds_of(row));
      }
  feedback.with_feedback = true;
  return feedback.first_s <= feedback.last_s ? feedback : all;
}

void tell_outcome(const RunRecord& record, RunBehaviour& run) {
  run.result = "cut_short";
  run.sentence = "no outcome was written: it was killed, or it is still going on";
  if (!record.outcome) return;
  run.result = record.outcome->text_or("result", "cut_short");
  run.sentence = record.outcome->text_or("sentence", "");
  // Where the cart follows a pendulum that it cannot catch, the track may end first: a fall, as in
  // experiments.
  const std::string reason = record.outcome->text_or("reason", "");
  run.fell = reason == name_of(StopReason::fell) || reason == name_of(StopReason::track_limit);
  run.ended_s = record.outcome->number_or("time_s", run.ended_s);
}

void measure(const RunRecord& record, const Extent& extent, RunBehaviour& run) {
  run.to_s = extent.last_s;
  run.from_s = extent.last_s - last_part * (extent.last_s - extent.first_s);
  BehaviourMeter meter(run.from_s, run.to_s);
  SampleReader reader(record.path / "samples.csv");
  for (LogRecord row; reader.next(row); row = {})
    if (counts(row, extent.with_feedback)) meter.add(row);
  run.rows = meter.rows();
  run.behaviour = meter.result();
  if (!run.behaviour) run.problem = "its last third is too short to say anything";
  const auto described = record.document.optional_map("run");
  const bool is_virtual = described && described->flag_or("virtual_time", false);
  const DurationHistogram& late = meter.lateness();
  if (!is_virtual && late.count() > 0)
    run.lateness = {late.quantile_us(0.5), late.quantile_us(0.99), late.max_us()};
}

}  // namespace

BehaviourMeter::BehaviourMeter(double from_s, double to_s) : from_s_(from_s), to_s_(to_s) {
  const double batches = std::floor((to_s - from_s) / min_batch_s);
  const std::size_t count = batches < static_cast<double>(min_batches)
                                ? 1
                                : std::min(max_batches, static_cast<std::size_t>(batches));
  batches_.assign(count, {infinity, -infinity, infinity, -infinity});
}

void BehaviourMeter::add(const LogRecord& row) {
  const double time_s = seconds_of(row);
  const double step_v = last_voltage_v_ ? row.voltage_v - *last_voltage_v_ : 0.0;
  last_voltage_v_ = row.voltage_v;
  if (time_s < from_s_ || time_s > to_s_) return;
  const double part = (time_s - from_s_) / (to_s_ - from_s_);
  const auto count = static_cast<double>(batches_.size());
  Batch& batch = batches_[static_cast<std::size_t>(std::clamp(part * count, 0.0, count - 1.0))];
  batch.low_cart_m = std::min(batch.low_cart_m, row.cart_m);
  batch.high_cart_m = std::max(batch.high_cart_m, row.cart_m);
  batch.low_theta_rad = std::min(batch.low_theta_rad, row.theta_rad);
  batch.high_theta_rad = std::max(batch.high_theta_rad, row.theta_rad);
  batch.voltage_squares += row.voltage_v * row.voltage_v;
  batch.step_squares += step_v * step_v;
  ++batch.rows;
  ++rows_;
  lateness_.add(row.wake_late_ns);
}

std::optional<Behaviour> BehaviourMeter::result() const {
  if (to_s_ - from_s_ < min_window_s || rows_ < min_rows) return std::nullopt;
  Batch whole{infinity, -infinity, infinity, -infinity};
  std::vector<double> carts, thetas, voltages, steps;
  for (const Batch& batch : batches_) {
    if (batch.rows == 0) continue;  // a gap in the log
    const auto rows = static_cast<double>(batch.rows);
    carts.push_back(batch.high_cart_m - batch.low_cart_m);
    thetas.push_back(batch.high_theta_rad - batch.low_theta_rad);
    voltages.push_back(batch.voltage_squares / rows);
    steps.push_back(batch.step_squares / rows);
    whole.low_cart_m = std::min(whole.low_cart_m, batch.low_cart_m);
    whole.high_cart_m = std::max(whole.high_cart_m, batch.high_cart_m);
    whole.low_theta_rad = std::min(whole.low_theta_rad, batch.low_theta_rad);
    whole.high_theta_rad = std::max(whole.high_theta_rad, batch.high_theta_rad);
    whole.voltage_squares += batch.voltage_squares;
    whole.step_squares += batch.step_squares;
  }
  const auto rows = static_cast<double>(rows_);
  return Behaviour{{peak_to_peak(whole.high_cart_m - whole.low_cart_m, carts),
                    peak_to_peak(whole.high_theta_rad - whole.low_theta_rad, thetas),
                    root_mean_square(whole.voltage_squares / rows, voltages),
                    root_mean_square(whole.step_squares / rows, steps)}};
}

RunBehaviour behaviour_of_run(const std::filesystem::path& directory) {
  const RunRecord record = read_run_without_samples(directory);
  RunBehaviour run;
  run.run = directory;
  run.name = std::filesystem::absolute(directory / "").parent_path().filename().string();
  run.sample_rate_hz = record.control.sample_rate_hz;
  const Extent extent = extent_of(record.path / "samples.csv");
  const bool has_rows = extent.first_s < extent.last_s;
  run.ended_s = has_rows ? extent.last_s : 0.0;
  tell_outcome(record, run);
  if (has_rows)
    measure(record, extent, run);
  else
    run.problem = "its log holds no rows to compare";
  return run;
}

std::vector<Difference> differences_between(const RunBehaviour& before, const RunBehaviour& after) {
  std::vector<Difference> differences;
  if (!before.behaviour || !after.behaviour) return differences;
  for (std::size_t k = 0; k < quantities.size(); ++k) {
    const Estimate &a = before.behaviour->values[k], &b = after.behaviour->values[k];
    Difference difference{k, a.value, b.value, {}};
    if (a.ci95 && b.ci95) {
      // The half of each interval that faces the other: the difference's own is the root of their squares.
      const bool rises = b.value > a.value;
      const double half_a = rises ? (*a.ci95)[1] - a.value : a.value - (*a.ci95)[0];
      const double half_b = rises ? b.value - (*b.ci95)[0] : (*b.ci95)[1] - b.value;
      difference.is_clear = std::abs(b.value - a.value) > std::hypot(half_a, half_b);
    }
    differences.push_back(difference);
  }
  const auto size = [](const Difference& d) {
    const double smaller = std::max(std::min(d.from, d.to), 1e-12);
    return std::max(d.from, d.to) / smaller;
  };
  std::stable_sort(differences.begin(), differences.end(), [&](const Difference& x, const Difference& y) {
    const bool x_clear = x.is_clear.value_or(false), y_clear = y.is_clear.value_or(false);
    return x_clear != y_clear ? x_clear : size(x) > size(y);
  });
  return differences;
}

}  // namespace upright
