#include "machine_check.hpp"

#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>

namespace upright {

namespace {

namespace fs = std::filesystem;

std::string first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

Finding kernel(const fs::path& root) {
  utsname system{};
  uname(&system);
  const std::string release = system.release;
  const bool preemptible = first_line(root / "sys/kernel/realtime") == "1";
  if (preemptible) return {"kernel", Health::good, "PREEMPT_RT, " + release, ""};
  return {
      "kernel", Health::poor, release + " without PREEMPT_RT",
      "install linux-image-rt-amd64 and boot it: wake-ups then stay within tens of microseconds under load"};
}

Finding isolation(const fs::path& root) {
  const std::string isolated = first_line(root / "sys/devices/system/cpu/isolated");
  if (!isolated.empty()) return {"processors", Health::good, "isolated: " + isolated, ""};
  return {"processors", Health::poor, "none is isolated",
          "boot with isolcpus=managed_irq,domain,N for the last processor N, which the loop takes"};
}

/// The speed governors in use, each once.
std::string governors(const fs::path& root) {
  std::string all;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(root / "sys/devices/system/cpu", none)) {
    const std::string governor = first_line(entry.path() / "cpufreq/scaling_governor");
    if (!governor.empty() && all.find(governor) == std::string::npos)
      all += (all.empty() ? "" : ", ") + governor;
  }
  return all;
}

Finding speed(const fs::path& root) {
  const std::string found = governors(root);
  if (found.empty())
    return {"governor", Health::good, "the kernel does not change the processors' speed", ""};
  if (found == "performance") return {"governor", Health::good, found, ""};
  return {"governor", Health::poor, found, "cpupower frequency-set --governor performance"};
}

Finding sleep_states(const fs::path& root) {
  const fs::path device = root / "dev/cpu_dma_latency";
  if (::access(device.c_str(), W_OK) == 0)
    return {"sleep states", Health::good, "kept shallow during a run", ""};
  std::error_code none;
  if (!fs::exists(root / "sys/devices/system/cpu/cpu0/cpuidle/state1", none))
    return {"sleep states", Health::good, "the kernel knows no deep ones", ""};
  return {
      "sleep states", Health::poor, device.string() + " cannot be written: processors may sleep deeply",
      "let your group write it: a udev rule KERNEL==\"cpu_dma_latency\", GROUP=\"upright\", MODE=\"0660\""};
}

std::string amount(rlim_t limit) {
  return limit == RLIM_INFINITY ? "unlimited" : std::to_string(limit);
}

Finding priority_limit() {
  constexpr rlim_t wanted = 80;
  rlimit limit{};
  getrlimit(RLIMIT_RTPRIO, &limit);
  if (::geteuid() == 0) return {"rtprio", Health::good, "root needs no limit", ""};
  if (limit.rlim_cur >= wanted) return {"rtprio", Health::good, amount(limit.rlim_cur), ""};
  return {"rtprio", Health::poor, "limited to " + amount(limit.rlim_cur),
          "join the group upright (groupadd --system upright; usermod --append --groups upright USER), put "
          "'@upright - "
          "rtprio 90' into /etc/security/limits.d/upright.conf and log in again"};
}

Finding memory_limit() {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  if (::geteuid() == 0) return {"memlock", Health::good, "root needs no limit", ""};
  if (limit.rlim_cur == RLIM_INFINITY) return {"memlock", Health::good, "unlimited", ""};
  return {"memlock", Health::poor, "limited to " + amount(limit.rlim_cur) + " bytes",
          "join the group upright (groupadd --system upright; usermod --append --groups upright USER), put "
          "'@upright - "
          "memlock unlimited' into /etc/security/limits.d/upright.conf and log in again"};
}

}  // namespace

std::vector<Finding> examine_machine(const fs::path& root) {
  return {kernel(root), isolation(root), speed(root), sleep_states(root), priority_limit(), memory_limit()};
}

std::vector<Finding> examine_grant(const RealtimeGrant& grant) {
  const bool scheduled = grant.policy == "SCHED_FIFO";
  Finding scheduling{"scheduling", scheduled ? Health::good : Health::poor,
                     scheduled ? "SCHED_FIFO " + std::to_string(grant.priority) + " granted" : grant.policy,
                     scheduled ? "" : "raise the limit rtprio, or give the program CAP_SYS_NICE"};
  Finding memory{"memory", grant.memory_locked ? Health::good : Health::poor,
                 grant.memory_locked ? "locked" : "not locked",
                 grant.memory_locked ? "" : "raise the limit memlock, or give the program CAP_IPC_LOCK"};
  return {scheduling, memory};
}

}  // namespace upright
