#include "../quanser_proof.hpp"

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <thread>
#include <utility>

#include "quanser_card.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

/// Throws DeviceError with what failed.
using Trial = std::function<std::string(QuanserCard&)>;

std::string fact(const DeviceFacts& facts, const std::string& name) {
  for (const auto& [key, value] : facts)
    if (key == name) return value;
  return "unknown";
}

std::string library_words(QuanserCard& card) {
  return card.library().path() + ", version " + card.library().version();
}

std::string board_words(QuanserCard& card) {
  const DeviceFacts facts = card.facts();
  return fact(facts, "product") + ", model " + fact(facts, "model") + ", serial number " +
         fact(facts, "serial_number") + ", firmware " + fact(facts, "firmware_version");
}

std::string read_encoders(QuanserCard& card) {
  RawCounts counts;
  if (const hil::Error error = card.read_counts(counts); error < 0) card.fail(error, "reading the encoders");
  RawVelocities velocities;
  return "read, counts " + std::to_string(counts.cart) + " (cart) and " + std::to_string(counts.pendulum) +
         " (pendulum); " +
         (card.read_velocities(velocities) >= 0 ? "the card also measures velocities (encoder_velocities)"
                                                : "the card does not measure velocities");
}

std::string set_up(QuanserCard& card) {
  card.prepare();
  return "done";
}

std::string prove_output(QuanserCard& card) {
  card.prepare();
  return "accepts zero volts" + std::string(card.has_enable() ? ", with the amplifier disabled" : "");
}

void wait_for_expiry(double watchdog_s) {
  constexpr double surely = 3.0, min_extra_s = 0.05;
  std::this_thread::sleep_for(std::chrono::duration<double>(surely * watchdog_s + min_extra_s));
}

std::string prove_watchdog(QuanserCard& card) {
  if (const hil::Error error = card.start_watchdog(); error < 0) card.fail(error, "starting the watchdog");
  const hil::Error served = card.reload_watchdog();
  if (served < 0) card.fail(served, "resetting the watchdog");
  if (served != hil::reloaded)
    throw DeviceError("the watchdog expired immediately after its start: raise quanser_hil.watchdog_s");
  wait_for_expiry(card.watchdog_s());
  const hil::Error after = card.reload_watchdog();
  if (after < 0) card.fail(after, "reading whether the watchdog had expired");
  if (after != hil::expired_before)
    throw DeviceError(
        "the watchdog was not reset but did not expire: do not rely on it, and protect the "
        "amplifier's enable with another watchdog");
  if (const hil::Error error = card.clear_watchdog(); error < 0) card.fail(error, "clearing the watchdog");
  card.stop_watchdog();
  if (const hil::Error error = card.put_out(0.0); error < 0)
    card.fail(error, "writing zero volts after the watchdog was cleared");
  return "expires when it is not reset, and can be cleared; its time is " + exact_text(card.watchdog_s()) +
         " s";
}

CardStep examined(const std::string& subject, QuanserCard& card, const Trial& trial) {
  try {
    return {subject, true, trial(card), ""};
  } catch (const DeviceError& problem) {
    return {subject, false, "this test failed", problem.what()};
  }
}

}  // namespace

std::vector<CardStep> prove_quanser_card(const RigFile& rig) {
  std::unique_ptr<QuanserCard> card;
  try {
    card = std::make_unique<QuanserCard>(rig);
  } catch (const DeviceError& problem) {
    return {{"Quanser card", false, "it cannot be opened", problem.what()}};
  }
  std::vector<std::pair<const char*, Trial>> trials = {{"Quanser library", library_words},
                                                       {"Quanser card", board_words}};
  if (rig.quanser->output)
    trials.emplace_back("Quanser card's output", prove_output);
  else
    trials.emplace_back("Quanser card's set-up", set_up);
  if (rig.quanser->cart_channel || rig.quanser->pendulum_channel)
    trials.emplace_back("Quanser card's encoders", read_encoders);
  if (rig.quanser->watchdog_s > 0.0) trials.emplace_back("Quanser card's watchdog", prove_watchdog);
  std::vector<CardStep> steps;
  for (const auto& [subject, trial] : trials) {
    steps.push_back(examined(subject, *card, trial));
    if (!steps.back().passed) return steps;
  }
  return steps;
}

}  // namespace upright
