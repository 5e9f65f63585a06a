// The JSON Schema of a list of keys, on lists that are small enough to see the whole of it.
#include <gtest/gtest.h>

#include "schema/schema_keys.hpp"

namespace upright {
namespace {

constexpr Words<3> shapes = {"point", "circle", "ring"};

Json parsed(const char* text) {
  return Json::parse(text);
}

TEST(Schema, HasTypeRangeDefaultAndWhetherAKeyIsRequired) {
  const Json schema = schema_of([](PieceKeys& keys) {
    double mass = 0.0, delay = 0.0;
    std::optional<double> length;
    int count = 0;
    keys.number("mass_kg", mass, Range::positive());
    keys.number("delay_s", delay, Range::within(0.0, 10.0), 2.5);
    keys.optional_number("length_m", length, Range::any());
    keys.integer("count", count, 1, 9);
  });
  EXPECT_EQ(schema, parsed(R"({"type": "object", "additionalProperties": false,
    "properties": {"mass_kg": {"type": "number", "exclusiveMinimum": 0.0},
                   "delay_s": {"type": "number", "minimum": 0.0, "maximum": 10.0, "default": 2.5},
                   "length_m": {"type": "number"},
                   "count": {"type": "integer", "minimum": 1, "maximum": 9}},
    "required": ["mass_kg", "count"]})"));
}

TEST(Schema, TellsWhichKeysAWordNeeds) {
  const Json schema = schema_of([](PieceKeys& keys) {
    bool is_ring = false;
    double radius = 0.0;
    keys.one_of("shape", is_ring, Words<2>{"point", "ring"});
    if (is_ring) keys.number("radius_m", radius, Range::any());
  });
  EXPECT_EQ(schema["required"], parsed(R"(["shape"])"));
  EXPECT_EQ(schema["allOf"],
            parsed(R"([{"if": {"properties": {"shape": {"const": "point"}}, "required": ["shape"]},
    "then": {"properties": {"radius_m": false}}, "else": {"required": ["radius_m"]}}])"));
}

TEST(Schema, HasAnAlternativeForEachOfThreeKinds) {
  const Json schema = schema_of([](PieceKeys& keys) {
    std::size_t shape = 0;
    double radius = 0.0;
    keys.one_of("shape", shape, {shapes.begin(), shapes.end()});
    keys.needs("shape", shape != 2, "is not made", "choose another");
    if (shape > 0) keys.number("radius_m", radius, Range::any());
  });
  EXPECT_EQ(schema, parsed(R"({"anyOf": [
    {"type": "object", "additionalProperties": false, "properties": {"shape": {"const": "point"}},
     "required": ["shape"]},
    {"type": "object", "additionalProperties": false,
     "properties": {"shape": {"const": "circle"}, "radius_m": {"type": "number"}},
     "required": ["shape", "radius_m"]}]})"));
}

TEST(Schema, LeavesOutWordsOnWhichNothingDepends) {
  const Json schema = schema_of([](PieceKeys& keys) {
    bool flag = false;
    std::size_t shape = 0;
    keys.flag("flag", flag);
    keys.one_of("shape", shape, {shapes.begin(), shapes.end()});
  });
  EXPECT_FALSE(schema.contains("allOf")) << schema;
}

TEST(Schema, RefusesWhatIsRefusedTogetherWithTheReason) {
  const Json schema = schema_of([](PieceKeys& keys) {
    bool fast = false, careful = false;
    keys.flag("fast", fast);
    keys.flag("careful", careful);
    keys.needs("fast", !fast || !careful, "is not careful", "choose one");
  });
  EXPECT_EQ(schema["allOf"], parsed(R"([{"if": {"properties": {"fast": {"const": false}}}, "else": {"allOf": [
    {"if": {"properties": {"careful": {"const": false}}},
     "else": {"not": {}, "errorMessage": "fast is not careful: choose one"}}]}}])"));
}

TEST(Schema, TriesBothFormsOfAKeyThatMayBeAMap) {
  const Json schema = schema_of([](PieceKeys& keys) {
    std::string column;
    if (keys.is_map("column", false))
      keys.map("column", [&column](YamlKeys& map) { map.text("name", column); });
    else
      keys.text("column", column);
  });
  const Json& forms = schema["properties"]["column"]["anyOf"];
  ASSERT_EQ(forms.size(), 2u) << schema;
  EXPECT_EQ(forms[0]["required"], parsed(R"(["name"])"));
  EXPECT_EQ(forms[1]["minLength"], 1);
  EXPECT_EQ(schema["required"], parsed(R"(["column"])"));
}

TEST(Schema, LooksIntoAMapOnWhichOthersDepend) {
  const Json schema = schema_of([](PieceKeys& keys) {
    bool has_friction = false;
    double share = 0.0;
    keys.deciding_map("model", [&](YamlKeys& map) { map.flag("friction", has_friction); });
    if (has_friction) keys.number("share", share, Range::any());
  });
  EXPECT_EQ(schema["allOf"][0]["if"]["properties"]["model"]["properties"]["friction"],
            parsed(R"({"const": false})"));
  EXPECT_EQ(schema["allOf"][0]["then"], parsed(R"({"properties": {"share": false}})"));
}

TEST(Schema, StatesChecksOfSizesAndNumbers) {
  const Json schema = schema_of([](PieceKeys& keys) {
    std::vector<double> ends;
    double noise = 0.0, scale = 1.0;
    keys.numbers("ends", ends, Range::any());
    keys.check_size("ends", 2, 2, 2, "", "");
    keys.number("noise", noise, Range::not_negative());
    keys.check_min("noise", noise, 1e-3, true, "", "");
    keys.number("scale", scale, Range::any());
    keys.check_not_zero("scale", scale, "", "");
    keys.require_any({"ends", "noise"});
  });
  const Json& properties = schema["properties"];
  EXPECT_EQ(properties["ends"]["minItems"], 2);
  EXPECT_EQ(properties["ends"]["maxItems"], 2);
  EXPECT_EQ(properties["noise"]["anyOf"], parsed(R"([{"const": 0}, {"minimum": 0.001}])"));
  EXPECT_EQ(properties["scale"]["not"], parsed(R"({"const": 0})"));
  EXPECT_EQ(schema["allOf"], parsed(R"([{"anyOf": [{"required": ["ends"]}, {"required": ["noise"]}]}])"));
}

}  // namespace
}  // namespace upright
