// The ways through a list of keys. A list may go on in another way after a word, a flag or the presence of a
// key. Every such outcome is tried, and the ways form a tree: `explore` makes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace upright {

using Json = nlohmann::ordered_json;

/// Something on which the rest of a list of keys may depend.
struct Decision {
  enum class About : std::uint8_t { presence, is_map, pattern, value };
  static constexpr std::size_t yes = 0, no = 1;  ///< outcomes of what is not a value

  About about = About::presence;
  std::vector<std::string> maps;  ///< from the object down to the map with the key
  std::string key;
  std::string pattern;
  std::vector<Json> values;              ///< the outcomes of a value
  std::optional<std::size_t> otherwise;  ///< the value without the key

  std::size_t outcomes() const { return about == About::value ? values.size() : 2; }
  bool is_about(About what, const std::string& own_key) const {
    return about == what && maps.empty() && key == own_key;
  }
  bool operator==(const Decision& other) const = default;
};

/// A key of an object.
struct Property {
  std::string key;
  Json schema;
  bool is_required = false;
};

/// What one way leads to.
struct WayEnd {
  std::vector<Property> properties;
  std::vector<std::vector<std::string>> any_of;  ///< lists of keys of which one must be there
  std::string refusal;  ///< why the outcomes together are refused; empty: they are not

  Property* find(const std::string& key);
};

/// A node of the tree.
struct Branch {
  std::optional<Decision> decision;  ///< none: an end
  std::vector<std::unique_ptr<Branch>> children;
  WayEnd end;
};

/// One way: what was decided so far.
class Way {
 public:
  explicit Way(const std::vector<std::size_t>& outcomes) : outcomes_(outcomes) {}
  /// The outcome of a decision: the same as before where it was made before.
  std::size_t decide(const Decision& decision);
  /// Whether it was decided that the key is not there.
  bool decided_absent(const std::vector<std::string>& maps, const std::string& key) const;
  const std::vector<Decision>& decisions() const { return decisions_; }
  std::size_t outcome(std::size_t at) const { return at < outcomes_.size() ? outcomes_[at] : 0; }

 private:
  std::vector<std::size_t> outcomes_;  ///< zero where there are none
  std::vector<Decision> decisions_;
};

/// Ends a way that is refused.
struct RefusedWay {
  const Way* way;
  std::string reason;
};

/// Goes every way of `go`, which fills in what its way leads to.
std::unique_ptr<Branch> explore(const std::function<void(Way&, WayEnd&)>& go);

}  // namespace upright
