#include "described_curve.hpp"

#include "upright/model/effects/force_table.hpp"

namespace upright {

std::optional<DescribedCurve> described_curve(const FoundEffect& effect) {
  using Table = effects::ForceTable;
  if (effect.effect != effect_index<Table>()) return std::nullopt;
  const std::vector<ParameterEstimate>& p = effect.parameters;
  const auto over = static_cast<std::size_t>(p[0].value);
  DescribedCurve curve;
  curve.over = Table::over_words[over];
  curve.unit = over == Table::velocity ? "m/s" : "m";
  const double spacing = (p[2].value - p[1].value) / static_cast<double>(Table::node_count - 1);
  for (std::size_t i = 0; i < Table::node_count; ++i) {
    const ParameterEstimate& node = p[Table::first_node + i];
    curve.at.push_back(p[1].value + spacing * static_cast<double>(i));
    curve.force_n.push_back(node.value);
    curve.low_n.push_back(node.low);
    curve.high_n.push_back(node.high);
  }
  return curve;
}

}  // namespace upright
