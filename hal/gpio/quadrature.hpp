// Counts from the edges of an incremental encoder, and every way to notice that edges are missing. Pure
// functions of what they are given; no allocation.
#pragma once

#include <array>
#include <cstdint>

#include "upright/hal/rig.hpp"

namespace upright {

/// One edge of line A or B: the level after it.
struct Edge {
  bool of_b = false;
  bool level = false;
  std::int64_t time_ns = 0;
};

/// The levels of both lines.
struct LinePair {
  bool a = false;
  bool b = false;
  bool operator==(const LinePair&) const = default;
};

/// Four counts per cycle, up where A leads B.
///
/// Two lost edges of one line leave both levels as they were, so that no transition looks wrong: what is
/// noticed here is an edge to a level that the line has already, levels that do not match when they are read,
/// and edges faster than the source can be trusted with. Whoever numbers edges notices the rest.
class QuadratureDecoder {
 public:
  explicit QuadratureDecoder(double fastest_edges_per_s) noexcept;

  /// Zero counts, at these levels.
  void start(LinePair levels) noexcept;
  /// Edges in the order in which they happened. Faults stay until start().
  RigFault take(const Edge& edge) noexcept;
  /// The lines' levels, read at `now_ns` after every edge at hand was taken. Levels may be ahead of the
  /// edges, which take their way through the kernel: they are given `settling_ns` to come.
  RigFault compare(LinePair levels, std::int64_t now_ns) noexcept;
  RigFault fail(RigFault fault) noexcept;

  RigFault fault() const noexcept { return fault_; }
  std::int64_t counts() const noexcept { return counts_; }
  LinePair levels() const noexcept { return levels_; }

  static constexpr std::int64_t settling_ns = 5'000'000;
  /// Edges may come in bursts: this is the time over which their rate counts.
  static constexpr double burst_s = 0.01;

 private:
  bool too_fast(std::int64_t time_ns) noexcept;

  double fastest_edges_per_s_;
  double max_edges_;    // in a burst
  double burst_ = 0.0;  // edges not yet paid for by time
  std::int64_t last_ns_ = 0;
  bool have_last_ = false;
  LinePair levels_;
  std::int64_t counts_ = 0;
  std::uint64_t edges_ = 0;
  bool differs_ = false;  // the levels read last did not match
  std::int64_t differs_since_ns_ = 0;
  std::uint64_t differs_at_edge_ = 0;
  RigFault fault_ = RigFault::none;
};

/// Puts numbered edges into the order of their numbers: each line has an interrupt thread of its own, and the
/// later edge may be reported first.
class EdgeSequence {
 public:
  /// The number that comes next.
  void start(std::uint32_t number) noexcept;
  /// False: the number was there already, or so many are missing before it that they will not come.
  bool put(std::uint32_t number, const Edge& edge) noexcept;
  /// The next edge, if it has come.
  bool next(Edge& edge) noexcept;
  /// Edges that wait for an earlier one.
  bool waits() const noexcept { return waiting_ > 0; }

 private:
  static constexpr std::uint32_t room = 64;
  struct Slot {
    Edge edge;
    bool is_taken = false;
  };
  std::array<Slot, room> slots_{};
  std::uint32_t next_ = 1;
  std::uint32_t waiting_ = 0;
};

}  // namespace upright
