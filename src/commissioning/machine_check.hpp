// What this machine offers a real-time loop: kernel, processors, limits, and whether SCHED_FIFO is really
// granted.
#pragma once

#include <filesystem>
#include <vector>

#include "finding.hpp"
#include "upright/runtime/realtime.hpp"

namespace upright {

/// Where the kernel's files are: "/" but in tests.
std::vector<Finding> examine_machine(const std::filesystem::path& root = "/");

/// Judges what a thread was granted that asked for it.
std::vector<Finding> examine_grant(const RealtimeGrant& grant);

}  // namespace upright
