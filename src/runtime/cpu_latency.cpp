#include "cpu_latency.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdint>

namespace upright {

CpuLatencyHold::CpuLatencyHold(const std::filesystem::path& device) noexcept {
  descriptor_ = ::open(device.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor_ < 0) return;
  const std::int32_t no_latency_us = 0;
  if (::write(descriptor_, &no_latency_us, sizeof no_latency_us) == sizeof no_latency_us) return;
  ::close(descriptor_);
  descriptor_ = -1;
}

CpuLatencyHold::~CpuLatencyHold() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace upright
