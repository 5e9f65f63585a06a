// The fake Quanser card as a process of its own, the rig file that a controller has of it, and its record.
#pragma once

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "../../integration/virtual_rig_process.hpp"

namespace upright::test {

/// What was on the card's output channel, and on the line that enables the amplifier.
struct CardRow {
  double time_s = 0.0, analog_v = 0.0;
  bool enabled = false, locked = false;
};

class CardProcess {
 public:
  /// `rig_text` is what the card is wired as; its identifier is put in here.
  CardProcess(const Folder& folder, const std::string& rig_text, const std::vector<std::string>& flags = {})
      : socket_(folder / "card"),
        trace_(folder / "trace.csv"),
        record_(folder / "record.csv"),
        rig_text_(replaced(rig_text, "board_identifier: \"0\"",
                           "board_identifier: \"0@unix:" + socket_.string() + "\"")),
        process_(command(folder, flags)) {
    if (const std::string line = process_.line(); line.rfind("listening on ", 0) != 0)
      throw std::runtime_error("the fake card did not start: " + line);
  }

  const std::string& rig_text() const { return rig_text_; }
  pid_t id() const { return process_.id(); }
  void end() { process_.end(SIGTERM); }
  std::vector<TraceRow> trace() const { return read_trace(trace_); }
  std::vector<CardRow> record() const {
    std::ifstream in(record_);
    std::string line;
    std::getline(in, line);
    std::vector<CardRow> rows;
    while (std::getline(in, line)) {
      std::replace(line.begin(), line.end(), ',', ' ');
      std::istringstream words(line);
      CardRow row;
      if (words >> row.time_s >> row.analog_v >> row.enabled >> row.locked) rows.push_back(row);
    }
    return rows;
  }

 private:
  std::vector<std::string> command(const Folder& folder, const std::vector<std::string>& flags) const {
    const std::filesystem::path rig = folder / "card.yaml";
    std::ofstream(rig) << rig_text_;
    std::vector<std::string> words = {UPRIGHT_FAKE_CARD, "--rig",          rig.string(),
                                      "--socket",        socket_.string(), "--trace",
                                      trace_.string(),   "--record",       record_.string()};
    words.insert(words.end(), flags.begin(), flags.end());
    return words;
  }

  std::filesystem::path socket_, trace_, record_;
  std::string rig_text_;
  Process process_;
};

/// The shipped rig file of a Q2-USB on the fake library, with an enable line, zero where the fake plant
/// begins and the watchdog's time of the other benches.
inline std::string fake_card_rig() {
  std::string text = text_of(UPRIGHT_SOURCE_DIR "/config/rigs/quanser-q2-usb.yaml");
  text = replaced(text, "library: libhil.so", "library: " UPRIGHT_FAKE_HIL);
  text = replaced(text, "zero: {at: start, pose: hanging}",
                  "zero: {at: counts, cart_counts: 0, pendulum_counts: 0, pose: upright}");
  text = replaced(text, "  watchdog_s: 0.05", "  watchdog_s: 0.1");
  return text + "  amplifier_enable: {line: 0, active: high}\n";
}

/// The same, where the card is the clock.
inline std::string on_the_cards_clock(const std::string& rig_text) {
  return replaced(rig_text, "  board_type: q2_usb\n", "  board_type: q2_usb\n  clock: card\n");
}

}  // namespace upright::test
