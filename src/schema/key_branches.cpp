#include "key_branches.hpp"

#include <algorithm>

namespace upright {

Property* WayEnd::find(const std::string& key) {
  const auto at = std::find_if(properties.begin(), properties.end(),
                               [&key](const Property& property) { return property.key == key; });
  return at == properties.end() ? nullptr : &*at;
}

std::size_t Way::decide(const Decision& decision) {
  const auto at = std::find(decisions_.begin(), decisions_.end(), decision);
  const auto place = static_cast<std::size_t>(at - decisions_.begin());
  if (at == decisions_.end()) decisions_.push_back(decision);
  return outcome(place);
}

bool Way::decided_absent(const std::vector<std::string>& maps, const std::string& key) const {
  for (std::size_t i = 0; i < decisions_.size(); ++i) {
    const Decision& made = decisions_[i];
    if (made.about == Decision::About::presence && made.maps == maps && made.key == key)
      return outcome(i) == Decision::no;
  }
  return false;
}

namespace {

void insert(Branch& root, const Way& way, WayEnd end) {
  Branch* branch = &root;
  for (std::size_t i = 0; i < way.decisions().size(); ++i) {
    const Decision& decision = way.decisions()[i];
    if (!branch->decision) {
      branch->decision = decision;
      for (std::size_t k = 0; k < decision.outcomes(); ++k)
        branch->children.push_back(std::make_unique<Branch>());
    }
    branch = branch->children[way.outcome(i)].get();
  }
  branch->end = std::move(end);
}

/// The next way in the order of a counter whose last digit is the last decision; empty after the last way.
std::optional<std::vector<std::size_t>> next_of(const Way& way) {
  for (std::size_t at = way.decisions().size(); at-- > 0;) {
    if (way.outcome(at) + 1 == way.decisions()[at].outcomes()) continue;
    std::vector<std::size_t> next;
    for (std::size_t i = 0; i < at; ++i) next.push_back(way.outcome(i));
    next.push_back(way.outcome(at) + 1);
    return next;
  }
  return std::nullopt;
}

}  // namespace

std::unique_ptr<Branch> explore(const std::function<void(Way&, WayEnd&)>& go) {
  auto root = std::make_unique<Branch>();
  std::optional<std::vector<std::size_t>> next = std::vector<std::size_t>{};
  while (next) {
    Way way(*next);
    WayEnd end;
    try {
      go(way, end);
    } catch (const RefusedWay& refused) {
      if (refused.way != &way) throw;
      end.refusal = refused.reason;
    }
    next = next_of(way);
    insert(*root, way, std::move(end));
  }
  return root;
}

}  // namespace upright
