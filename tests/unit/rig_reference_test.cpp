// docs/reference/rig-files.md states the range and the default of every key of a rig file as the reader has
// them: the list of keys by which a file is read is visited here, too.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "hal/backends.hpp"
#include "hal/rig_keys.hpp"

namespace upright {
namespace {

const std::filesystem::path page = std::filesystem::path(UPRIGHT_SOURCE_DIR) / "docs/reference/rig-files.md";

/// As the page writes numbers: 1e-9, 0.001, 65535, π.
std::string number_text(double value) {
  if (value == std::numbers::pi) return "π";
  const std::string text = std::regex_replace(exact_text(value), std::regex("\\.0$"), "");
  return std::regex_replace(text, std::regex("e([+-])0*"), value < 1.0 ? "e-" : "e");
}

std::string range_text(const Range& range) {
  const std::string low = number_text(range.low), high = number_text(range.high);
  return range.low_open ? "above " + low + ", at most " + high : low + " to " + high;
}

std::string code(const std::string& word) {
  return "`" + word + "`";
}

/// What the reader accepts for a key. A key that depends on others has several ranges or defaults.
struct Accepted {
  std::set<std::string> ranges, defaults;
  bool is_optional = false;
  bool needs_row = true;  ///< its own keys describe a map that must be there
};

using Keys = std::map<std::string, Accepted>;

/// Collects the keys with their paths, such as "modbus.counters.table". Optional keys count as given.
class KeyCollector : public YamlKeys {
 public:
  KeyCollector(Keys& keys, std::string prefix) : keys_(keys), prefix_(std::move(prefix)) {}

  void number(const char* key, double&, const Range& range, std::optional<double> otherwise, Usual) override {
    note(key, range_text(range), otherwise ? number_text(*otherwise) : "");
  }
  void numbers(const char* key, std::vector<double>&, const Range& range) override {
    note(key, range_text(range), "");
  }
  void flag(const char* key, bool&, bool otherwise, Usual) override {
    note(key, "`true`, `false`", code(otherwise ? "true" : "false"));
  }
  void text(const char* key, std::string&, const std::optional<std::string>& otherwise, Usual) override {
    if (otherwise) given_.insert(key);
    note(key, "text", "");
  }
  void path(const char* key, std::filesystem::path&) override { note(key, "path", ""); }
  void map(const char* key, const Visit& visit) override {
    if (!prefix_.empty() && given_.count(key) > 0)
      note(key, "map", "");
    else
      keys_[prefix_ + key].needs_row = false;
    KeyCollector inside(keys_, prefix_ + key + ".");
    visit(inside);
  }
  bool given(const char* key, bool is_set) override {
    if (prefix_ == "backend.") return is_set;  // it has either cart_encoder and pendulum_encoder, or encoders
    given_.insert(key);
    return true;
  }

 protected:
  void whole_number(const char* key, std::int64_t&, std::int64_t low, std::int64_t high,
                    std::optional<std::int64_t> otherwise) override {
    const bool is_sign = low == -1 && high == 1;
    note(key, is_sign ? "1, -1" : std::to_string(low) + " to " + std::to_string(high),
         otherwise ? std::to_string(*otherwise) : "");
  }
  void choice(const char* key, std::size_t&, const std::vector<std::string>& words,
              std::optional<std::size_t> otherwise) override {
    std::string all;
    for (const std::string& word : words) all += (all.empty() ? "" : ", ") + code(word);
    note(key, all, otherwise ? code(words.at(*otherwise)) : "");
  }
  void maps(const char* key, std::size_t, const VisitItem& visit) override {
    note(key, "list", "");
    KeyCollector inside(keys_, prefix_ + key + ".");
    visit(inside, 0);
  }

 private:
  void note(const std::string& key, const std::string& range, const std::string& otherwise) {
    Accepted& accepted = keys_[prefix_ + key];
    accepted.ranges.insert(range);
    if (!otherwise.empty())
      accepted.defaults.insert(otherwise);
    else if (given_.count(key) > 0)
      accepted.is_optional = true;
    else
      accepted.defaults.insert("required");
  }

  Keys& keys_;
  std::string prefix_;
  std::set<std::string> given_;
};

RigFile rig_of(Backend backend) {
  RigFile rig;
  rig.cart_encoder = rig.pendulum_encoder = rig.output = backend;
  rig.calibration.cart.width_bits = rig.calibration.pendulum.width_bits = 32;
  rig.simulated.emplace();
  rig.modbus.emplace();
  rig.comedi.emplace();
  rig.quanser.emplace().folder = "libraries";
  rig.gpio.emplace();
  rig.gpio->limit_switches.emplace_back();
  rig.encoder_watch.emplace();
  return rig;
}

/// Every key of a rig file: with each backend, and with each setting that other keys depend on.
Keys accepted_keys() {
  std::vector<RigFile> rigs;
  for (const Backend backend :
       {Backend::simulated, Backend::modbus_tcp, Backend::modbus_rtu, Backend::quanser_hil})
    rigs.push_back(rig_of(backend));
  RigFile parts = rig_of(Backend::comedi);
  parts.output = Backend::modbus_tcp;
  rigs.push_back(parts);
  parts.pendulum_encoder = Backend::gpio;
  rigs.push_back(parts);
  RigFile two_registers = rig_of(Backend::modbus_tcp);
  two_registers.calibration.zero_at_start = true;
  two_registers.modbus->counter.registers = 2;
  two_registers.modbus->voltage.encoding = VoltageEncoding::int32;
  rigs.push_back(two_registers);
  for (const ComediEncoderKind kind :
       {ComediEncoderKind::counter, ComediEncoderKind::plain_counter, ComediEncoderKind::analog_input}) {
    RigFile comedi = rig_of(Backend::comedi);
    comedi.comedi->cart.emplace().kind = comedi.comedi->pendulum.emplace().kind = kind;
    rigs.push_back(comedi);
  }
  Keys keys;
  for (RigFile& rig : rigs) {
    KeyCollector collector(keys, "");
    rig_keys(collector, rig);
  }
  return keys;
}

/// A row of a table of keys.
struct Row {
  std::string range, otherwise;
};

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line.substr(1));
  for (std::string cell; std::getline(in, cell, '|');) {
    const std::size_t first = cell.find_first_not_of(' '), last = cell.find_last_not_of(' ');
    cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
  }
  return cells;
}

std::vector<std::string> codes_in(const std::string& cell) {
  std::vector<std::string> codes;
  const std::regex pattern("`([^`]+)`");
  for (std::sregex_iterator at(cell.begin(), cell.end(), pattern), end; at != end; ++at)
    codes.push_back((*at)[1]);
  return codes;
}

/// The tables of keys: the heading "key of `modbus`" puts "modbus." before the keys of its table.
std::map<std::string, Row> stated_keys() {
  std::ifstream in(page);
  std::map<std::string, Row> rows;
  std::string prefix;
  std::ptrdiff_t range = -1, otherwise = -1;
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("|", 0) != 0) range = -1;
    if (line.rfind("|---", 0) == 0 || line.rfind("|", 0) != 0) continue;
    const std::vector<std::string> cells = cells_of(line);
    if (cells.front().rfind("key", 0) == 0) {
      const std::vector<std::string> section = codes_in(cells.front());
      prefix = section.empty() ? "" : section.front() + ".";
      range = std::find(cells.begin(), cells.end(), "range") - cells.begin();
      otherwise = std::find(cells.begin(), cells.end(), "default") - cells.begin();
    } else if (range >= 0) {
      for (const std::string& key : codes_in(cells.front()))
        rows[prefix + key] = {cells.at(static_cast<std::size_t>(range)),
                              cells.at(static_cast<std::size_t>(otherwise))};
    }
  }
  return rows;
}

/// Whether a cell states a range or a default: not as a part of another number.
bool states(const std::string& cell, const std::string& wanted) {
  for (std::size_t at = cell.find(wanted); at != std::string::npos; at = cell.find(wanted, at + 1)) {
    const auto continues = [&](std::size_t place) {
      return place < cell.size() &&
             (std::isalnum(static_cast<unsigned char>(cell[place])) != 0 || cell[place] == '.');
    };
    if ((at == 0 || !continues(at - 1)) && !continues(at + wanted.size())) return true;
  }
  return false;
}

TEST(RigReference, StatesTheRangeAndTheDefaultOfEveryKey) {
  const std::map<std::string, Row> stated = stated_keys();
  for (const auto& [key, accepted] : accepted_keys()) {
    const auto row = stated.find(key);
    if (row == stated.end()) {
      EXPECT_FALSE(accepted.needs_row) << page.string() << " has no row for " << key << ": add it";
      continue;
    }
    for (const std::string& range : accepted.ranges)
      EXPECT_TRUE(states(row->second.range, range))
          << key << ": the reader accepts " << range << ", the page says " << row->second.range;
    for (const std::string& otherwise : accepted.defaults)
      EXPECT_TRUE(states(row->second.otherwise, otherwise))
          << key << ": the default is " << otherwise << ", the page says " << row->second.otherwise;
    if (accepted.is_optional) {
      EXPECT_FALSE(states(row->second.otherwise, "required")) << key << " may be left out";
      EXPECT_FALSE(row->second.otherwise.empty()) << key;
    }
  }
}

TEST(RigReference, HasNoKeyThatTheReaderDoesNotKnow) {
  const Keys accepted = accepted_keys();
  for (const auto& [key, row] : stated_keys()) EXPECT_EQ(accepted.count(key), 1u) << key;
}

}  // namespace
}  // namespace upright
