#include "signals.hpp"

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "upright/base/error.hpp"

namespace upright::cli {

namespace {

SignalFlag caught_signal{0};
std::atomic<unsigned> requests{0};
static_assert(SignalFlag::is_always_lock_free && std::atomic<unsigned>::is_always_lock_free);

/// The first of several keeps its name.
void note_signal(int number) {
  if (number == SIGINT || number == SIGTERM || number == SIGQUIT)
    requests.fetch_add(1, std::memory_order_relaxed);
  int nothing = 0;
  caught_signal.compare_exchange_strong(nothing, number, std::memory_order_relaxed);
}

pthread_t main_thread;

constexpr int computing_signals[] = {SIGINT, SIGTERM};

void end_at_once(int /*number*/) {
  constexpr char sentence[] = "upright: interrupted before the first result: start the command again\n";
  const ssize_t ignored = write(STDERR_FILENO, sentence, sizeof sentence - 1);
  static_cast<void>(ignored);
  _exit(static_cast<int>(ExitCode::stopped));
}

void note_first_signal(int number) {
  note_signal(number);
  for (const int next : computing_signals) signal(next, SIG_DFL);
}

void handle_computing_signals(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  for (const int number : computing_signals) sigaction(number, &action, nullptr);
}

}  // namespace

void end_on_signal() {
  handle_computing_signals(end_at_once);
}

const SignalFlag& answer_on_signal() {
  handle_computing_signals(note_first_signal);
  return caught_signal;
}

const SignalFlag& catch_signals() {
  main_thread = pthread_self();
  struct sigaction action {};
  action.sa_handler = note_signal;
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP}) sigaction(number, &action, nullptr);
  // A file size limit shall be a failed write, which stops the motor, not the end of the process; and a
  // terminal that belongs to somebody else a failed read or an unread line.
  action.sa_handler = SIG_IGN;
  for (const int number : {SIGXFSZ, SIGTTIN, SIGTTOU}) sigaction(number, &action, nullptr);
  return caught_signal;
}

unsigned end_requests() noexcept {
  return requests.load(std::memory_order_relaxed);
}

void press_stop_button() noexcept {
  note_signal(stop_button_pressed);
  // The main thread may wait for a key: a signal wakes it. One that is no request to give the stop up.
  pthread_kill(main_thread, SIGHUP);
}

std::string command_line() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  while (!text.empty() && text.back() == '\0') text.pop_back();
  std::replace(text.begin(), text.end(), '\0', ' ');
  return text;
}

}  // namespace upright::cli
