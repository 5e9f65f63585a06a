#include "upright/base/yaml_reader.hpp"

#include <gtest/gtest.h>

#include <functional>

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
            "f.yaml:2: a second document begins here: keep one YAML document");
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

}  // namespace
}  // namespace upright
