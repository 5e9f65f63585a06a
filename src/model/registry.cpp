#include "upright/model/registry.hpp"

#include <algorithm>

namespace upright {

namespace {

constexpr auto infos = []<std::size_t... I>(std::index_sequence<I...>) {
  return std::array<EffectInfo, effect_count>{EffectAt<I>::info...};
}
(std::make_index_sequence<effect_count>{});

constexpr auto offsets = []<std::size_t... I>(std::index_sequence<I...>) {
  return std::array<std::size_t, effect_count>{parameter_offset<I>...};
}
(std::make_index_sequence<effect_count>{});

}  // namespace

std::span<const EffectInfo> effect_registry() {
  return infos;
}

std::size_t effect_number(std::string_view kind) {
  for (std::size_t i = 0; i < effect_count; ++i)
    if (infos[i].kind == kind) return i;
  return effect_count;
}

std::size_t effect_parameter_offset(std::size_t effect) {
  return offsets.at(effect);
}

bool is_periodic(std::size_t effect) {
  return std::ranges::any_of(infos.at(effect).parameters,
                             [](const ParameterInfo& parameter) { return parameter.name == "pitch_m"; });
}

}  // namespace upright
