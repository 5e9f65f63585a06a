// Counts of link faults during a run, by cause.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "upright/hal/rig.hpp"

namespace upright {

/// Why a cycle had no fresh counts.
enum class LinkTrouble : std::uint8_t {
  late,           ///< the reply had not arrived when the cycle could wait no longer
  no_reply,       ///< no reply within the response timeout
  no_connection,  ///< the connection is gone
  wrong_reply,    ///< corrupt, of an earlier request, or implausible counts
  refused,        ///< the device answered with an exception
  other,          ///< a fault of the device, not of the link
};

/// Cycles with trouble on the link, by cause.
struct LinkCounts {
  static constexpr std::size_t kinds = 6;  ///< how many causes there are

  std::array<std::uint64_t, kinds> cycles{};  ///< by LinkTrouble
  std::uint64_t longest = 0;                  ///< largest number of consecutive cycles without fresh counts
  std::uint64_t recoveries = 0;               ///< how often the link was recovered

  /// Cycles with this trouble.
  std::uint64_t of(LinkTrouble trouble) const noexcept { return cycles[static_cast<std::size_t>(trouble)]; }
  void add(const RigReading& reading) noexcept;  ///< counts one reading

 private:
  std::uint64_t in_a_row_ = 0;
};

/// "late_reply", "no_reply", "no_connection", "wrong_reply", "refused", "other".
const char* name_of(LinkTrouble trouble) noexcept;

/// "3 late replies, 1 wrong reply, at most 2 in a row; the link was brought back 1 time"; empty when all
/// counts are zero.
std::string sentence_of(const LinkCounts& counts);

/// Calls see(name, count) for each count, in the order of run.yaml and --json.
template <class See>
void for_each_count(const LinkCounts& link, See&& see) {
  for (std::size_t i = 0; i < LinkCounts::kinds; ++i)
    see(name_of(static_cast<LinkTrouble>(i)), link.cycles[i]);
  see("longest", link.longest);
  see("recoveries", link.recoveries);
}

}  // namespace upright
