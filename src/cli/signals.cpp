#include "signals.hpp"

#include <signal.h>

#include <algorithm>
#include <fstream>
#include <iterator>

namespace upright::cli {

namespace {

SignalFlag caught_signal{0};
static_assert(SignalFlag::is_always_lock_free);

void note_signal(int number) {
  caught_signal.store(number, std::memory_order_relaxed);
}

}  // namespace

const SignalFlag& catch_signals() {
  struct sigaction action {};
  action.sa_handler = note_signal;
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaction(number, &action, nullptr);
  // A file size limit shall be a failed write, which stops the motor, not the end of the process.
  action.sa_handler = SIG_IGN;
  sigaction(SIGXFSZ, &action, nullptr);
  return caught_signal;
}

std::string command_line() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  while (!text.empty() && text.back() == '\0') text.pop_back();
  std::replace(text.begin(), text.end(), '\0', ' ');
  return text;
}

bool is_simulated(const RigFile& rig) {
  return rig.encoders == Backend::simulated && rig.output == Backend::simulated;
}

}  // namespace upright::cli
