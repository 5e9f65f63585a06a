#include "quadrature.hpp"

#include <algorithm>

namespace upright {

namespace {

/// So few edges are no rate yet: a contact bounces, a shaft trembles.
constexpr double min_burst = 8.0;

}  // namespace

QuadratureDecoder::QuadratureDecoder(double fastest_edges_per_s) noexcept
    : fastest_edges_per_s_(fastest_edges_per_s),
      max_edges_(std::max(min_burst, fastest_edges_per_s * burst_s)) {}

void QuadratureDecoder::start(LinePair levels) noexcept {
  levels_ = levels;
  counts_ = 0;
  burst_ = 0.0;
  have_last_ = differs_ = false;
  fault_ = RigFault::none;
}

RigFault QuadratureDecoder::fail(RigFault fault) noexcept {
  if (fault_ == RigFault::none) fault_ = fault;
  return fault_;
}

/// Each edge costs one, and time pays for as many as may come in it.
bool QuadratureDecoder::too_fast(std::int64_t time_ns) noexcept {
  const double passed_s = have_last_ ? static_cast<double>(time_ns - last_ns_) * 1e-9 : 0.0;
  have_last_ = true;
  last_ns_ = time_ns;
  burst_ = std::max(0.0, burst_ - fastest_edges_per_s_ * std::max(0.0, passed_s)) + 1.0;
  return burst_ > max_edges_;
}

RigFault QuadratureDecoder::take(const Edge& edge) noexcept {
  if (fault_ != RigFault::none) return fault_;
  ++edges_;
  if (too_fast(edge.time_ns)) return fail(RigFault::edges_too_fast);
  bool& line = edge.of_b ? levels_.b : levels_.a;
  if (line == edge.level) return fail(RigFault::edges_lost);
  line = edge.level;
  const bool is_up = edge.of_b == (levels_.a == levels_.b);
  counts_ += is_up ? 1 : -1;
  return RigFault::none;
}

RigFault QuadratureDecoder::compare(LinePair levels, std::int64_t now_ns) noexcept {
  if (fault_ != RigFault::none) return fault_;
  if (levels == levels_) {
    differs_ = false;
  } else if (!differs_ || differs_at_edge_ != edges_) {
    differs_ = true;
    differs_since_ns_ = now_ns;
    differs_at_edge_ = edges_;
  } else if (now_ns - differs_since_ns_ > settling_ns) {
    return fail(RigFault::edges_lost);
  }
  return RigFault::none;
}

void EdgeSequence::start(std::uint32_t number) noexcept {
  for (Slot& slot : slots_) slot.is_taken = false;
  next_ = number;
  waiting_ = 0;
}

bool EdgeSequence::put(std::uint32_t number, const Edge& edge) noexcept {
  if (number - next_ >= room) return false;  // numbers wrap, and so does their difference
  Slot& slot = slots_[number % room];
  if (slot.is_taken) return false;
  slot = {edge, true};
  ++waiting_;
  return true;
}

bool EdgeSequence::next(Edge& edge) noexcept {
  Slot& slot = slots_[next_ % room];
  if (!slot.is_taken) return false;
  edge = slot.edge;
  slot.is_taken = false;
  --waiting_;
  ++next_;
  return true;
}

}  // namespace upright
