#include "signals.hpp"

#include <pthread.h>
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <iterator>

namespace upright::cli {

namespace {

SignalFlag caught_signal{0};
static_assert(SignalFlag::is_always_lock_free);

/// The first of several keeps its name.
void note_signal(int number) {
  int nothing = 0;
  caught_signal.compare_exchange_strong(nothing, number, std::memory_order_relaxed);
}

pthread_t main_thread;

}  // namespace

const SignalFlag& catch_signals() {
  main_thread = pthread_self();
  struct sigaction action {};
  action.sa_handler = note_signal;
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaction(number, &action, nullptr);
  // A file size limit shall be a failed write, which stops the motor, not the end of the process.
  action.sa_handler = SIG_IGN;
  sigaction(SIGXFSZ, &action, nullptr);
  return caught_signal;
}

void press_stop_button() noexcept {
  note_signal(stop_button_pressed);
  // The main thread may wait for a key: a signal wakes it.
  pthread_kill(main_thread, SIGINT);
}

std::string command_line() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  while (!text.empty() && text.back() == '\0') text.pop_back();
  std::replace(text.begin(), text.end(), '\0', ' ');
  return text;
}

}  // namespace upright::cli
