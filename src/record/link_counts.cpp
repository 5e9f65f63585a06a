#include "upright/record/link_counts.hpp"

#include <algorithm>

namespace upright {

namespace {

LinkTrouble trouble_of(const RigReading& reading) noexcept {
  if (reading.status == RigStatus::stale) return LinkTrouble::late;
  switch (reading.fault) {
    case RigFault::link_timeout:
      return LinkTrouble::no_reply;
    case RigFault::link_lost:
      return LinkTrouble::no_connection;
    case RigFault::corrupt_reply:
    case RigFault::out_of_range:
      return LinkTrouble::wrong_reply;
    case RigFault::device_refused:
    case RigFault::device_busy:
      return LinkTrouble::refused;
    default:
      return LinkTrouble::other;
  }
}

std::string counted(std::uint64_t count, const char* one, const char* several) {
  return std::to_string(count) + " " + (count == 1 ? one : several);
}

std::string words_for(LinkTrouble trouble, std::uint64_t count) {
  switch (trouble) {
    case LinkTrouble::late:
      return counted(count, "late reply", "late replies");
    case LinkTrouble::no_reply:
      return counted(count, "missing reply", "missing replies");
    case LinkTrouble::no_connection:
      return counted(count, "period without a connection", "periods without a connection");
    case LinkTrouble::wrong_reply:
      return counted(count, "invalid reply", "invalid replies");
    case LinkTrouble::refused:
      return counted(count, "refused request", "refused requests");
    case LinkTrouble::other:
      break;
  }
  return counted(count, "device fault", "device faults");
}

}  // namespace

void LinkCounts::add(const RigReading& reading) noexcept {
  recoveries = std::max<std::uint64_t>(recoveries, reading.recoveries);
  if (reading.status == RigStatus::fresh) {
    in_a_row_ = 0;
    return;
  }
  if (is_safety_input(reading.fault)) return;
  ++cycles[static_cast<std::size_t>(trouble_of(reading))];
  longest = std::max(longest, ++in_a_row_);
}

const char* name_of(LinkTrouble trouble) noexcept {
  switch (trouble) {
    case LinkTrouble::late:
      return "late_reply";
    case LinkTrouble::no_reply:
      return "no_reply";
    case LinkTrouble::no_connection:
      return "no_connection";
    case LinkTrouble::wrong_reply:
      return "wrong_reply";
    case LinkTrouble::refused:
      return "refused";
    case LinkTrouble::other:
      break;
  }
  return "other";
}

std::string sentence_of(const LinkCounts& counts) {
  std::string text;
  for (std::size_t i = 0; i < LinkCounts::kinds; ++i)
    if (counts.cycles[i] > 0)
      text += (text.empty() ? "" : ", ") + words_for(static_cast<LinkTrouble>(i), counts.cycles[i]);
  if (counts.longest > 1) text += ", at most " + std::to_string(counts.longest) + " in a row";
  if (counts.recoveries > 0) {
    text += text.empty() ? "" : "; ";
    text += "the link was re-established " + counted(counts.recoveries, "time", "times");
  }
  return text;
}

}  // namespace upright
