// force_table: a cart force that no formula describes, as values at equidistant nodes over one quantity.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "upright/model/effect.hpp"
#include "upright/model/scalar.hpp"

namespace upright::effects {

/// Between two nodes the force is the cubic with the central differences as slopes (Catmull and Rom): it
/// passes through the nodes, has a continuous slope, and reproduces straight lines. At the first and the
/// last node the slope is that of the neighbouring interval; beyond them the force is constant.
struct ForceTable {
  static constexpr std::size_t node_count = 13;  ///< the number of nodes
  static constexpr std::size_t first_node = 3;   ///< place of the first node among the parameters

  /// The quantity over which the force stands, by its number. Over `position_and_direction` the force is the
  /// level of dry friction, which a contact makes act against the motion. So the table itself never jumps.
  enum Over { velocity, position, position_and_direction, position_and_velocity, over_count };
  /// These words stand in a plant file.
  static constexpr std::string_view over_words[] = {"velocity", "position", "position_and_direction",
                                                    "position_and_velocity"};

  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"over", "1", Range::within(0.0, 3.0), no_neutral, 0.0, "the quantity over which the nodes lie",
       over_words},
      {"from", "m/s or m", Range::any(), no_neutral, -0.5, "where the first node lies"},
      {"to", "m/s or m", Range::any(), no_neutral, 0.5, "where the last node lies"},
      {"force_01_n", "N", Range::any(), 0.0, 0.3, "f at node 1"},
      {"force_02_n", "N", Range::any(), 0.0, 0.3, "f at node 2"},
      {"force_03_n", "N", Range::any(), 0.0, 0.3, "f at node 3"},
      {"force_04_n", "N", Range::any(), 0.0, 0.3, "f at node 4"},
      {"force_05_n", "N", Range::any(), 0.0, 0.3, "f at node 5"},
      {"force_06_n", "N", Range::any(), 0.0, 0.3, "f at node 6"},
      {"force_07_n", "N", Range::any(), 0.0, 0.3, "f at node 7"},
      {"force_08_n", "N", Range::any(), 0.0, 0.3, "f at node 8"},
      {"force_09_n", "N", Range::any(), 0.0, 0.3, "f at node 9"},
      {"force_10_n", "N", Range::any(), 0.0, 0.3, "f at node 10"},
      {"force_11_n", "N", Range::any(), 0.0, 0.3, "f at node 11"},
      {"force_12_n", "N", Range::any(), 0.0, 0.3, "f at node 12"},
      {"force_13_n", "N", Range::any(), 0.0, 0.3, "f at node 13"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "force_table",
      Enters::cart,
      false,
      "F = f(v), F = f(x), dry level f(x), or F = -f(x) v / (1 m/s); f by a smooth curve through the nodes",
      "a force that no formula describes, drawn through 13 equidistant nodes",
      parameters};
  static_assert(std::size(parameters) == first_node + node_count);

  /// Whether the force lies over this quantity.
  template <class S>
  static bool is_over(const S* p, Over over) {
    if constexpr (requires { value_of(p[0]); }) {
      return value_of(p[0]) == static_cast<double>(over);
    } else {
      return is_plainly(p[0], static_cast<double>(over));
    }
  }

  /// Whether it is a level of dry friction.
  template <class S>
  static bool has_cart_dry_level(const S* p) {
    return is_over(p, position_and_direction);
  }

  /// Force on the cart [N].
  template <class S>
  static S cart_force(const S* p, const S& x, const S& v) {
    if (is_over(p, velocity)) return curve(p, v);
    if (is_over(p, position)) return curve(p, x);
    if (is_over(p, position_and_velocity)) return -curve(p, x) * v;
    return S(0.0);
  }

  /// Level of dry friction [N].
  template <class S>
  static S cart_dry_level(const S* p, const S& x, const S& /*speed*/, const S& /*direction*/) {
    return has_cart_dry_level(p) ? curve(p, x) : S(0.0);
  }

  /// The curve through the nodes.
  template <class S>
  static S curve(const S* p, const S& at) {
    const S cells = S(static_cast<double>(node_count - 1)) * (at - p[1]) / (p[2] - p[1]);
    const S* f = p + first_node;
    if constexpr (requires { value_of(cells); }) {
      const double place = value_of(cells);
      if (!(place > 0.0)) return f[0];
      if (!(place < static_cast<double>(node_count - 1))) return f[node_count - 1];
      const auto k = static_cast<std::size_t>(place);
      return f[k] + rise(f, k, S(cells - S(static_cast<double>(k))));
    } else {
      // Lanes lie in different cells: the rise over each cell, as far as each lane has crossed it.
      S sum = f[0];
      for (std::size_t k = 0; k + 1 < node_count; ++k) {
        const S begun = positive_part(S(cells - S(static_cast<double>(k))));
        sum = sum + rise(f, k, S(S(1.0) - positive_part(S(S(1.0) - begun))));
      }
      return sum;
    }
  }

  /// Its greatest rate [1/s].
  static double rate_radps(const double* p, double v, double mass) {
    const double cell = (p[2] - p[1]) / static_cast<double>(node_count - 1);
    const double* f = p + first_node;
    double slope = 0.0, largest = std::abs(f[node_count - 1]);
    for (std::size_t k = 0; k + 1 < node_count; ++k) {
      slope = std::max(slope, std::abs(f[k + 1] - f[k]) / cell);
      largest = std::max(largest, std::abs(f[k]));
    }
    if (is_over(p, velocity)) return slope / mass;
    // A wave of four nodes is the shortest that the curve can draw.
    constexpr double quarter_turn = 1.5707963267948966;
    const double passing = quarter_turn * std::abs(v) / cell;
    if (is_over(p, position_and_velocity)) return passing + (largest + slope * std::abs(v)) / mass;
    return passing + std::sqrt(slope / mass);
  }

 private:
  template <class S>
  static S slope_at(const S* f, std::size_t k) {
    if (k == 0) return f[1] - f[0];
    if (k + 1 == node_count) return f[k] - f[k - 1];
    return S(0.5) * (f[k + 1] - f[k - 1]);
  }

  /// From node k to the share `t` (0 to 1) of the way to the next.
  template <class S>
  static S rise(const S* f, std::size_t k, const S& t) {
    const S step = f[k + 1] - f[k], begin = slope_at(f, k), end = slope_at(f, k + 1);
    const S square = S(3.0) * step - S(2.0) * begin - end, cube = begin + end - S(2.0) * step;
    return t * (begin + t * (square + t * cube));
  }
};

}  // namespace upright::effects
