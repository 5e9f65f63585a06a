#include "progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <system_error>
#include <utility>

namespace upright::cli {

namespace {

using namespace std::chrono_literals;

constexpr auto quiet_on_terminal = 1s;  ///< what takes no longer shows nothing
constexpr auto redraw_pause = 200ms;
constexpr auto line_pause = 10s;     ///< where stderr is no terminal: logs stay short
constexpr double nearly_done = 0.9;  ///< from this share on the end is in sight
constexpr int bar_columns = 20;
constexpr std::size_t usual_columns = 80;
constexpr std::size_t longest_line = 240;  ///< where stderr is no terminal

std::size_t terminal_columns() {
  winsize size{};
  if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return usual_columns;
  return size.ws_col;
}

std::string bar(double share) {
  std::string text(bar_columns + 2, '.');
  text.front() = '[';
  std::fill_n(text.begin() + 1, static_cast<std::ptrdiff_t>(share * bar_columns), '#');
  text.back() = ']';
  return text + " ";
}

}  // namespace

std::string duration_text(double seconds) {
  char text[48];
  const auto whole = static_cast<long long>(std::llround(std::clamp(seconds, 0.0, 1e9)));
  if (whole < 120)
    std::snprintf(text, sizeof text, "%lld s", whole);
  else if (whole < 7200)
    std::snprintf(text, sizeof text, "%lld min %lld s", whole / 60, whole % 60);
  else
    std::snprintf(text, sizeof text, "%lld h %lld min", whole / 3600, whole / 60 % 60);
  return text;
}

Progress::Progress(std::string step, double takes_s)
    : on_terminal_(::isatty(STDERR_FILENO) != 0),
      started_(std::chrono::steady_clock::now()),
      step_began_(started_),
      expected_s_(takes_s),
      step_(std::move(step)),
      first_report_(started_) {
  try {
    drawer_ = std::thread([this] { draw_until_closed(); });
  } catch (const std::system_error&) {
    // Without a further thread the work goes on unseen.
  }
}

Progress::~Progress() {
  end();
}

void Progress::end() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  if (drawer_.joinable()) drawer_.join();
  clear_line();
}

void Progress::aside(const std::function<void()>& speak) {
  const std::lock_guard lock(mutex_);
  clear_line();
  speak();
}

void Progress::begin(std::string step, double takes_s) {
  const std::lock_guard lock(mutex_);
  step_began_ = std::chrono::steady_clock::now();
  expected_s_ = takes_s;
  step_ = std::move(step);
  detail_.clear();
  share_ = first_share_ = unknown;
  begun_again_ = false;
  several_steps_ = true;
}

void Progress::report(double share, const std::string& detail) {
  const std::lock_guard lock(mutex_);
  detail_ = detail;
  if (!std::isfinite(share)) return;
  share = std::clamp(share, 0.0, 1.0);
  if (std::isnan(first_share_)) {
    first_share_ = share;
    first_report_ = std::chrono::steady_clock::now();
  }
  // An estimate that goes back would confuse more than it tells.
  share_ = std::isnan(share_) ? share : std::max(share_, share);
}

void Progress::report(std::size_t done, std::size_t known, const std::string& things) {
  const double share = known > 0 ? static_cast<double>(done) / static_cast<double>(known) : unknown;
  report(share, std::to_string(done) + " of " + std::to_string(known) + " " + things);
}

void Progress::report_search(double share, const std::string& detail) {
  {
    const std::lock_guard lock(mutex_);
    begun_again_ = begun_again_ || (share_ >= nearly_done && share < share_);
    if (begun_again_) {
      detail_ = detail;
      share_ = first_share_ = unknown;
      return;
    }
  }
  report(share, detail);
}

ProgressCallback Progress::callback() {
  return [this](double share, const std::string& what) { report(share, what); };
}

/// Of a step whose length is known.
void Progress::update_estimate(Time now) {
  if (!(expected_s_ > 0.0)) return;
  first_share_ = 0.0;
  first_report_ = step_began_;
  share_ = std::min(1.0, std::chrono::duration<double>(now - step_began_).count() / expected_s_);
}

std::string Progress::time_left(Time now) const {
  const double gained = share_ - first_share_;
  if (!(gained > 0.0)) return {};
  const double took_s = std::chrono::duration<double>(now - first_report_).count();
  const std::string left = duration_text(took_s * (1.0 - share_) / gained) + " left";
  return several_steps_ ? left + " in this step, " : left + ", ";
}

/// "sweep: 34 %, 12 of 40 runs, 38 s left, 20 s elapsed"; the detail gives way where there are few columns.
std::string Progress::line(Time now, std::size_t columns) const {
  std::string begin = step_ + ": ";
  if (!std::isnan(share_)) {
    char percent[16];
    std::snprintf(percent, sizeof percent, "%.0f %%, ", std::floor(100.0 * share_));
    begin += percent;
    if (on_terminal_) begin = bar(share_) + begin;
  }
  const std::string end =
      time_left(now) + duration_text(std::chrono::duration<double>(now - started_).count()) + " elapsed";
  const std::size_t taken = begin.size() + end.size() + 2;
  const std::string detail = detail_.substr(0, columns > taken ? columns - taken : 0);
  return (begin + (detail.empty() ? detail : detail + ", ") + end).substr(0, columns);
}

void Progress::draw_until_closed() {
  std::unique_lock lock(mutex_);
  const auto pause = on_terminal_ ? std::chrono::milliseconds(redraw_pause) : line_pause;
  Time next = started_ + (on_terminal_ ? std::chrono::milliseconds(quiet_on_terminal) : line_pause);
  while (!changed_.wait_until(lock, next, [this] { return closing_; })) {
    const Time now = std::chrono::steady_clock::now();
    next = std::max(next + pause, now);
    update_estimate(now);
    if (!on_terminal_) {
      std::fprintf(stderr, "upright: %s\n", line(now, longest_line).c_str());
      continue;
    }
    // The last column stays free: a terminal would begin a new line after it.
    std::string text = line(now, terminal_columns() - 1);
    const std::size_t columns = text.size();
    text.resize(std::max(columns, drawn_columns_), ' ');
    std::fprintf(stderr, "\r%s", text.c_str());
    std::fflush(stderr);
    drawn_columns_ = columns;
  }
}

void Progress::clear_line() {
  if (drawn_columns_ == 0) return;
  std::fprintf(stderr, "\r%s\r", std::string(drawn_columns_, ' ').c_str());
  std::fflush(stderr);
  drawn_columns_ = 0;
}

}  // namespace upright::cli
