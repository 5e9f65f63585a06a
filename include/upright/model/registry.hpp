// The list of all effects: at run time (names, units, ranges, equations) and at compile time (offsets,
// folds).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include "upright/model/effects/all.hpp"

namespace upright {

constexpr std::size_t effect_count = std::tuple_size_v<AllEffects>;  ///< the number of effects
constexpr std::size_t max_effect_parameters = 16;                    ///< no effect has more parameters

/// The type of effect I.
template <std::size_t I>
using EffectAt = std::tuple_element_t<I, AllEffects>;

/// The number of parameters of effect I.
template <std::size_t I>
constexpr std::size_t parameter_count_of = std::size(EffectAt<I>::parameters);

/// Offset of the parameters of effect I in the array of all parameters.
template <std::size_t I>
constexpr std::size_t parameter_offset = parameter_offset<I - 1> + parameter_count_of<I - 1>;
/// Those of the first effect come first.
template <>
inline constexpr std::size_t parameter_offset<0> = 0;

/// The number of parameters of all effects together.
constexpr std::size_t all_parameter_count =
    parameter_offset<effect_count - 1> + parameter_count_of<effect_count - 1>;

/// Index of an effect type, which identifies it in plants and masks.
template <class E, std::size_t I = 0>
constexpr std::size_t effect_index() {
  if constexpr (std::is_same_v<EffectAt<I>, E>) {
    return I;
  } else {
    return effect_index<E, I + 1>();
  }
}

/// Calls `f.template operator()<I>()` for every effect index I.
template <class F>
constexpr void for_each_effect(F&& f) {
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    (f.template operator()<I>(), ...);
  }
  (std::make_index_sequence<effect_count>{});
}

/// The descriptions of all effects in the order of registration; the index is the effect's number.
std::span<const EffectInfo> effect_registry();

/// The index of a kind; `effect_count` when it does not exist.
std::size_t effect_number(std::string_view kind);

/// Offset of the parameters of an effect in the array of all parameters.
std::size_t effect_parameter_offset(std::size_t effect);

/// Whether an effect repeats along the track with a pitch of its own: one of its parameters is `pitch_m`.
bool is_periodic(std::size_t effect);

/// A set of effects known at run time.
struct EffectSet {
  std::uint64_t mask = 0;  ///< bit I: effect I is in the set
  /// Whether effect I is in the set.
  template <std::size_t I>
  constexpr bool has() const {
    return (mask >> I & 1u) != 0;
  }
  /// Whether this effect is in the set.
  constexpr bool has(std::size_t effect) const { return (mask >> effect & 1u) != 0; }
  void add(std::size_t effect) { mask |= std::uint64_t{1} << effect; }  ///< puts this effect into the set
  /// Any effect may be in the set.
  template <std::size_t I>
  static constexpr bool may_have() {
    return true;
  }
};
static_assert(effect_count <= 64);

/// A set of effects known at compile time: absent effects cost nothing.
template <std::uint64_t Mask>
struct StaticEffectSet {
  /// Whether effect I is in the set.
  template <std::size_t I>
  static constexpr bool has() {
    return (Mask >> I & 1u) != 0;
  }
  /// False: it is not in the set, and its equations need not know the scalar.
  template <std::size_t I>
  static constexpr bool may_have() {
    return has<I>();
  }
};

}  // namespace upright
