#include "upright/base/yaml_reader.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "base/yaml_keys.hpp"
#include "upright/base/error.hpp"

namespace upright {
namespace {

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(YamlReader, ReadsNumbersExactlyAsWritten) {
  const YamlMap map = YamlMap::from_text("a: 0.1\nb: 1e-3\nc: -2\n", "f.yaml");
  EXPECT_EQ(map.number("a"), 0.1);
  EXPECT_EQ(map.number("b"), 1e-3);
  EXPECT_EQ(map.number("c"), -2.0);
  map.finish();
}

TEST(YamlReader, ExactTextReadsBackToTheSameBits) {
  for (const double value : {0.1, 1.0 / 3.0, 1e300, -5e-324, 3.0}) {
    const YamlMap map = YamlMap::from_text("v: " + exact_text(value), "f.yaml");
    EXPECT_EQ(map.number("v"), value);
  }
}

TEST(YamlReader, UnknownKeyNamesTheNearestKnownOneWithFileAndLine) {
  const YamlMap map = YamlMap::from_text("mass_kg: 1\nlenght_m: 2\n", "f.yaml");
  map.number("mass_kg");
  EXPECT_FALSE(map.has("length_m"));
  EXPECT_EQ(message_of([&] { map.finish(); }),
            "f.yaml:2: lenght_m is not a known key: did you mean length_m? otherwise remove it");
}

TEST(YamlReader, RefusesWhatIsNotAFiniteNumberInRange) {
  for (const char* bad :
       {"v: .nan", "v: .inf", "v: abc", "v: 1e999", "v: '1'", "v: [1]", "v: -1", "v:", "v: 1 2"}) {
    const YamlMap map = YamlMap::from_text(bad, "f.yaml");
    EXPECT_THROW(map.number("v", Range::positive()), ConfigError) << bad;
  }
}

TEST(YamlReader, RefusesDoubledKeysBrokenYamlAndDeepNesting) {
  EXPECT_THROW(YamlMap::from_text("a: 1\na: 2\n", "f.yaml"), ConfigError);
  EXPECT_THROW(YamlMap::from_text("a: [1\n", "f.yaml"), ConfigError);
  EXPECT_THROW(YamlMap::from_text("- 1\n", "f.yaml"), ConfigError);
  EXPECT_THROW(YamlMap::from_text(std::string(100000, '['), "f.yaml"), ConfigError);
}

TEST(YamlReader, RefusesASecondDocumentAndEndlessDocuments) {
  EXPECT_EQ(message_of([] { YamlMap::from_text("a: 1\n---\nb: 2\n", "f.yaml"); }),
            "f.yaml:2: a second document begins here: keep only one YAML document");
  EXPECT_THROW(YamlMap::from_text("a:\n   , - b'\n", "f.yaml"), ConfigError);
}

TEST(YamlReader, AMissingKeyIsNeitherAPlainValueNorAMapNorAList) {
  const YamlMap map = YamlMap::from_text("a: 1\n", "f.yaml");
  EXPECT_TRUE(map.is_scalar("a"));
  EXPECT_FALSE(map.is_scalar("b") || map.is_map("b") || map.is_list("b"));
}

TEST(YamlReader, BracketsInCommentsAndTextsAreNotNesting) {
  const std::string many(1000, '[');
  const YamlMap map = YamlMap::from_text("a: \"" + many + "\"  # " + many + "\n", "f.yaml");
  EXPECT_EQ(map.text("a"), many);
}

TEST(YamlReader, RefusesAZeroByteWhichNoPathCanHold) {
  EXPECT_THROW(YamlMap::from_text(std::string("plant: a\0b.yaml", 15), "bad.yaml"), ConfigError);
  EXPECT_THROW(YamlMap::from_text("plant: \"a\\0b.yaml\"", "bad.yaml"), ConfigError);
  EXPECT_THROW(YamlMap::from_text("\"plant\\x00\": a", "bad.yaml"), ConfigError);
}

/// A list of every sort of key.
struct Device {
  double gain = 0.0, offset = 0.5;
  int channel = 0;
  std::optional<int> line;
  bool inverted = false;
  std::string name;
  std::vector<int> switches;

  void keys(YamlKeys& keys) {
    constexpr Words<2> senses = {"plain", "inverted"};
    keys.text("name", name);
    keys.number("gain", gain, Range::positive());
    keys.number("offset", offset, Range::any(), 0.5, Usual::left_out);
    keys.section("wiring", [&](YamlKeys& wiring) {
      wiring.integer("channel", channel, 0, 7);
      wiring.optional_integer("line", line, 0, 7);
      wiring.one_of("sense", inverted, senses, false);
    });
    if (keys.given("switches", !switches.empty()))
      keys.items("switches", switches, [](YamlKeys& item, int& at) { item.integer("at", at, 0, 99); });
    keys.check("gain", gain < 100.0, "is too much", "lower it");
  }
  std::string text(YamlKeyWriter::Layout layout) const {
    Device copy = *this;
    YamlKeyWriter writer(layout);
    copy.keys(writer);
    return writer.written();
  }
  static Device read(const std::string& text) {
    const YamlMap map = YamlMap::from_text(text, "f.yaml");
    YamlKeyReader reader(map);
    Device device;
    device.keys(reader);
    map.finish();
    return device;
  }
};

TEST(YamlKeys, OneListReadsWhatItWrites) {
  using Layout = YamlKeyWriter::Layout;
  const std::string lines =
      "name: \"a \\\"b\\\"\"\ngain: 0.1\nwiring:\n  channel: 3\n  line: 5\n  sense: inverted\n"
      "switches:\n  - {at: 7}\n  - {at: 8}\n";
  const Device device = Device::read(lines);
  EXPECT_EQ(device.name, "a \"b\"");
  EXPECT_EQ(device.text(Layout::lines), lines);
  const std::string line = device.text(Layout::one_line);
  EXPECT_EQ(line,
            "name: \"a \\\"b\\\"\", gain: 0.1, wiring: {channel: 3, line: 5, sense: inverted}, "
            "switches: [{at: 7}, {at: 8}]");
  EXPECT_EQ(Device::read("{" + line + "}").text(Layout::lines), lines);
}

TEST(YamlKeys, RefusesAsTheReaderDoes) {
  const auto refusal = [](const std::string& text) { return message_of([&] { Device::read(text); }); };
  EXPECT_EQ(refusal("name: a\ngain: 100\nwiring: {channel: 3}\n"), "f.yaml:2: gain is too much: lower it");
  EXPECT_EQ(refusal("name: a\ngain: 1\nwiring: {channel: 3, lime: 5}\n"),
            "f.yaml:3: wiring.lime is not a known key: did you mean line? otherwise remove it");
  EXPECT_EQ(Device::read("name: a\ngain: 1\nwiring: {channel: 3}\n").text(YamlKeyWriter::Layout::one_line),
            "name: \"a\", gain: 1.0, wiring: {channel: 3, sense: plain}");
}

}  // namespace
}  // namespace upright
