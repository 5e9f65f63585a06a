#include "quanser_sampler.hpp"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <cmath>

#include "upright/base/error.hpp"
#include "upright/hal/clock.hpp"

namespace upright {

namespace {

/// Above the loop's, so that the time of a sample is the time at which it came.
constexpr int sampler_priority = 85;
/// Of a task that was stopped while somebody waited for its sample.
constexpr hil::Error stopped = -hil::interrupted;

constexpr double measured_for_s = 0.5, min_periods = 5.0;
constexpr int attempts_at_period = 3;  // a thread that is held up measures another period
constexpr double first_within_s = 1.0;
/// Cards divide their clock: a rate that they cannot make becomes the next one that they can. The controller
/// computes with the rate of the gain file, so that more than this is another controller.
constexpr double largest_deviation = 0.02;

std::int64_t nanoseconds(double seconds) noexcept {
  return static_cast<std::int64_t>(std::llround(1e9 * seconds));
}

}  // namespace

QuanserSampler::QuanserSampler(QuanserCard& card, double period_s, const std::string& rig_file)
    : card_(card), task_(card.start_sampling(1.0 / period_s)) {
  try {
    thread_ = std::thread([this] { take_samples(); });
    const sched_param parameters{sampler_priority};
    pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &parameters);  // where allowed
    require_period(period_s, rig_file);
  } catch (...) {
    end();
    throw;
  }
}

QuanserSampler::~QuanserSampler() {
  end();
}

void QuanserSampler::end() noexcept {
  card_.stop_sampling(task_);
  if (thread_.joinable()) thread_.join();
  card_.delete_task(task_);
}

/// The thread.
void QuanserSampler::take_samples() noexcept {
  RawCounts counts;
  for (RingSample sample;;) {
    const hil::Error came = card_.wait_for_sample(task_, counts);
    if (came > 0) {
      sample = {{sample.when.number + 1, monotonic_ns()}, counts.cart, counts.pendulum};
    } else {
      sample.trouble = came < 0 ? came : stopped;
    }
    samples_.publish(sample);
    if (came <= 0) return;
  }
}

void QuanserSampler::require_period(double period_s, const std::string& rig_file) const {
  double measured_s = 0.0;
  for (int i = 0; i < attempts_at_period; ++i) {
    measured_s = measured_period_s(period_s, rig_file);
    if (std::abs(measured_s / period_s - 1.0) <= largest_deviation) return;
  }
  throw DeviceError("the card of " + rig_file + " samples every " + exact_text(measured_s) +
                    " s, and not every " + exact_text(period_s) +
                    " s: give sample_rate_hz in the gain file a rate that the card's clock makes, or remove "
                    "quanser_hil.clock, so that the loop follows the computer's clock");
}

double QuanserSampler::measured_period_s(double period_s, const std::string& rig_file) const {
  const RingSample first = samples_.wait_for_another(
      samples_.latest().when.number, monotonic_ns() + nanoseconds(std::max(first_within_s, 2.0 * period_s)));
  const std::int64_t until_ns =
      monotonic_ns() + nanoseconds(std::max(measured_for_s, min_periods * period_s));
  RingSample last = first;
  while (last.trouble == 0 && monotonic_ns() < until_ns)
    last = samples_.wait_for_another(last.when.number, until_ns);
  if (last.trouble != 0) card_.fail(last.trouble, "sampling on the card's own clock");
  if (last.when.number == first.when.number)
    throw DeviceError(
        "the card of " + rig_file +
        " takes no samples on its own clock: remove quanser_hil.clock, so that the loop follows "
        "the computer's clock");
  return 1e-9 * static_cast<double>(last.when.time_ns - first.when.time_ns) /
         static_cast<double>(last.when.number - first.when.number);
}

}  // namespace upright
