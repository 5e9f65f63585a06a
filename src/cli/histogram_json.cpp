#include "histogram_json.hpp"

namespace upright::cli {

nlohmann::ordered_json histogram_json(const DurationHistogram& durations) {
  using Json = nlohmann::ordered_json;
  Json upper = Json::array(), count = Json::array();
  for (std::size_t i = 0; i < durations.buckets().size(); ++i) {
    if (durations.buckets()[i] == 0) continue;
    upper.push_back(static_cast<double>(durations.upper_end_ns(i)) / 1e3);
    count.push_back(durations.buckets()[i]);
  }
  return {{"count", durations.count()},
          {"mean_us", durations.mean_us()},
          {"p50_us", durations.quantile_us(0.5)},
          {"p99_us", durations.quantile_us(0.99)},
          {"p99_9_us", durations.quantile_us(0.999)},
          {"max_us", durations.max_us()},
          {"histogram_upper_us", upper},
          {"histogram_count", count}};
}

}  // namespace upright::cli
