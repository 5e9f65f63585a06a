// Suitability of this machine for a real-time loop: kernel, processors, limits, and whether SCHED_FIFO is
// granted.
#pragma once

#include <filesystem>
#include <vector>

#include "finding.hpp"
#include "runtime/realtime.hpp"

namespace upright {

/// Root of the kernel's files: "/" except in tests.
std::vector<Finding> examine_machine(const std::filesystem::path& root = "/");

/// Rates the real-time settings that a thread was granted.
std::vector<Finding> examine_grant(const RealtimeGrant& grant);

}  // namespace upright
