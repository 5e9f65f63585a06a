// Disturbs the C library under a run: the log's writes, and the machine's wall clock. Linked into a test it
// is told what to do by `disturb`; as a library for LD_PRELOAD by the variable UPRIGHT_SHIM, "KIND AFTER_S
// AMOUNT", and when it first strikes it writes the time into the file that UPRIGHT_SHIM_MARK names.
#pragma once

namespace upright::test {

enum class Disturbance {
  none,
  slow_writes,     ///< each write and sync of samples.csv takes `amount` seconds longer
  one_slow_write,  ///< one does
  kill_writer,     ///< the thread that writes samples.csv ends without a word
  step_clock,      ///< the wall clock is `amount` seconds ahead
};

/// From `after_s` on.
void disturb(Disturbance kind, double after_s, double amount);
/// When it struck first, on the monotonic clock; 0: not yet.
double struck_s();

}  // namespace upright::test
