// Statistics of a run's timing: a histogram of durations without allocation (exact extremes, percentiles
// within 1/8 octave), and how a device that was the clock of a run kept time.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace upright {

/// Durations, counted by size.
class DurationHistogram {
 public:
  /// Counts one duration [ns].
  void add(std::int64_t ns) noexcept {
    const std::uint64_t value = ns > 0 ? static_cast<std::uint64_t>(ns) : 0;
    ++buckets_[bucket_of(value)];
    ++count_;
    sum_ns_ += static_cast<double>(value);
    max_ns_ = std::max(max_ns_, value);
  }

  std::uint64_t count() const noexcept { return count_; }  ///< how many there were
  /// Their mean [us]; 0: there were none.
  double mean_us() const noexcept { return count_ == 0 ? 0.0 : sum_ns_ / static_cast<double>(count_) / 1e3; }
  double max_us() const noexcept { return static_cast<double>(max_ns_) / 1e3; }  ///< the longest [us]

  /// Quantile `part` (0 to 1) of the durations: the upper end of its bucket, at most the
  /// maximum.
  double quantile_us(double part) const noexcept {
    const double wanted = part * static_cast<double>(count_);
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < buckets_.size(); ++i) {
      seen += buckets_[i];
      if (static_cast<double>(seen) >= wanted && seen > 0)
        return std::min(static_cast<double>(upper_end_ns(i)), static_cast<double>(max_ns_)) / 1e3;
    }
    return max_us();
  }

  static constexpr std::size_t bucket_count = 8 * 40;  ///< eight to each doubling
  /// How many durations are in each bucket.
  const std::array<std::uint64_t, bucket_count>& buckets() const noexcept { return buckets_; }
  /// The longest duration of a bucket [ns].
  static constexpr std::uint64_t upper_end_ns(std::size_t bucket) noexcept {
    if (bucket < 8) return bucket;
    const std::uint64_t octave = bucket / 8, part = bucket % 8;
    return ((8 + part + 1) << (octave - 1)) - 1;
  }

 private:
  static constexpr std::size_t bucket_of(std::uint64_t ns) noexcept {
    if (ns < 8) return static_cast<std::size_t>(ns);
    const unsigned shift = static_cast<unsigned>(std::bit_width(ns)) - 4;
    const std::size_t bucket = 8 * (static_cast<std::size_t>(shift) + 1) + ((ns >> shift) & 7);
    return std::min(bucket, bucket_count - 1);
  }

  std::array<std::uint64_t, bucket_count> buckets_{};
  std::uint64_t count_ = 0, max_ns_ = 0;
  double sum_ns_ = 0.0;
};

/// How the clock of a device behaved.
struct DeviceTiming {
  std::uint64_t samples = 0;  ///< that arrived, from the run's first on
  std::uint64_t lost = 0;     ///< that were due and did not arrive
  double period_s = 0.0;      ///< between two samples, on average; 0: there were no two
  /// By how much that is longer than the nominal period: positive where the device's clock is slow.
  double drift_ppm = 0.0;
};

/// Calls see(name, value) for every fact, as run.yaml and --json list them.
template <class See>
void for_each_fact(const DeviceTiming& timing, See&& see) {
  see("samples", timing.samples);
  see("lost", timing.lost);
  see("period_s", timing.period_s);
  see("drift_ppm", timing.drift_ppm);
}

}  // namespace upright
