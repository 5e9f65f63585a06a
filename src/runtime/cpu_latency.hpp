// Keeps the processors out of deep sleep, from which they wake too late for a control period.
#pragma once

#include <filesystem>

namespace upright {

/// Holds /dev/cpu_dma_latency at zero while it lives; the kernel takes it back when the process ends. Where
/// that is not allowed, or the machine has no such file, nothing happens.
class CpuLatencyHold {
 public:
  explicit CpuLatencyHold(const std::filesystem::path& device = "/dev/cpu_dma_latency") noexcept;
  ~CpuLatencyHold();
  CpuLatencyHold(const CpuLatencyHold&) = delete;
  CpuLatencyHold& operator=(const CpuLatencyHold&) = delete;

  bool held() const noexcept { return descriptor_ >= 0; }

 private:
  int descriptor_ = -1;
};

}  // namespace upright
