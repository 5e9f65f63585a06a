#include "machine_check.hpp"

#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
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
      "install and boot linux-image-rt-amd64, which wakes the loop within tens of microseconds under load"};
}

Finding isolation(const fs::path& root) {
  const std::string isolated = first_line(root / "sys/devices/system/cpu/isolated");
  if (!isolated.empty()) return {"processors", Health::good, "isolated: " + isolated, ""};
  return {"processors", Health::poor, "none is isolated",
          "boot with isolcpus=managed_irq,domain,N, where N is the last processor, which the loop uses"};
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
  if (found.empty()) return {"governor", Health::good, "the kernel does not change the processor speed", ""};
  if (found == "performance") return {"governor", Health::good, found, ""};
  return {"governor", Health::poor, found, "run cpupower frequency-set --governor performance"};
}

Finding sleep_states(const fs::path& root) {
  const fs::path device = root / "dev/cpu_dma_latency";
  if (::access(device.c_str(), W_OK) == 0)
    return {"sleep states", Health::good, "kept shallow during a run", ""};
  std::error_code none;
  if (!fs::exists(root / "sys/devices/system/cpu/cpu0/cpuidle/state1", none))
    return {"sleep states", Health::good, "this kernel uses no deep ones", ""};
  return {"sleep states", Health::poor,
          device.string() + " cannot be written, so processors may enter deep sleep states",
          "give your group write access with the udev rule KERNEL==\"cpu_dma_latency\", GROUP=\"upright\", "
          "MODE=\"0660\""};
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
          "'@upright - rtprio 90' into /etc/security/limits.d/upright.conf, and log in again"};
}

Finding memory_limit() {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  if (::geteuid() == 0) return {"memlock", Health::good, "root needs no limit", ""};
  if (limit.rlim_cur == RLIM_INFINITY) return {"memlock", Health::good, "unlimited", ""};
  return {"memlock", Health::poor, "limited to " + amount(limit.rlim_cur) + " bytes",
          "join the group upright (groupadd --system upright; usermod --append --groups upright USER), put "
          "'@upright - memlock unlimited' into /etc/security/limits.d/upright.conf, and log in again"};
}

/// Whether a list of processors as the kernel writes it, "0,2-5", has this one.
bool lists(const std::string& list, int cpu) {
  std::istringstream parts(list);
  for (std::string part; std::getline(parts, part, ',');) {
    int first = 0, last = 0;
    const int numbers = std::sscanf(part.c_str(), "%d-%d", &first, &last);
    if (numbers >= 1 && cpu >= first && cpu <= (numbers == 2 ? last : first)) return true;
  }
  return false;
}

/// What follows `key=` on the kernel's command line.
std::string boot_option(const fs::path& root, const std::string& key) {
  std::istringstream words(first_line(root / "proc/cmdline"));
  for (std::string word; words >> word;)
    if (word.rfind(key + "=", 0) == 0) return word.substr(key.size() + 1);
  return "";
}

Finding tick(const fs::path& root, int cpu) {
  const std::string number = std::to_string(cpu);
  if (lists(first_line(root / "sys/devices/system/cpu/nohz_full"), cpu))
    return {"timer tick", Health::good, "off on processor " + number + " while only the loop runs there", ""};
  return {"timer tick", Health::poor,
          "processor " + number + " has it: several hundred interrupts per second besides those of the loop",
          "boot with nohz_full=" + number};
}

Finding rcu_callbacks(const fs::path& root, int cpu) {
  const std::string number = std::to_string(cpu);
  // The kernel takes the processors of nohz_full into it by itself.
  if (lists(boot_option(root, "rcu_nocbs"), cpu) ||
      lists(first_line(root / "sys/devices/system/cpu/nohz_full"), cpu))
    return {"RCU callbacks", Health::good, "not run on processor " + number, ""};
  return {"RCU callbacks", Health::poor, "processor " + number + " runs them, at unpredictable times",
          "boot with rcu_nocbs=" + number};
}

Finding interrupts(const fs::path& root, int cpu) {
  std::vector<std::string> here;
  std::size_t all = 0;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(root / "proc/irq", none)) {
    std::string served = first_line(entry.path() / "effective_affinity_list");
    if (served.empty()) served = first_line(entry.path() / "smp_affinity_list");
    if (served.empty()) continue;
    ++all;
    if (lists(served, cpu)) here.push_back(entry.path().filename().string());
  }
  const std::string number = std::to_string(cpu);
  if (all == 0)
    return {"interrupts", Health::not_examined, "the kernel does not report which processors handle them",
            ""};
  if (here.empty()) return {"interrupts", Health::good, "processor " + number + " handles none", ""};
  std::sort(here.begin(), here.end());
  return {"interrupts", Health::poor,
          std::to_string(here.size()) + " of " + std::to_string(all) + " may be handled by processor " +
              number + " and then delay the loop",
          "boot with isolcpus=managed_irq,domain," + number +
              ", stop irqbalance, and write the number of another processor into /proc/irq/" + here.front() +
              "/smp_affinity_list and those of the other interrupts"};
}

/// The kernel takes real-time threads off their processor once they have used this share of a second.
Finding throttling(const fs::path& root) {
  // A loop that spins for half of each period, the most it may, works for a part of the other half.
  constexpr double enough_share = 0.9;
  const std::string runtime = first_line(root / "proc/sys/kernel/sched_rt_runtime_us");
  const std::string period = first_line(root / "proc/sys/kernel/sched_rt_period_us");
  if (runtime.empty() || period.empty())
    return {"throttling", Health::not_examined, "the kernel does not report its limit on real-time threads",
            ""};
  const double runtime_us = std::strtod(runtime.c_str(), nullptr),
               period_us = std::strtod(period.c_str(), nullptr);
  if (runtime_us < 0.0)
    return {"throttling", Health::good, "off: a real-time thread in an endless loop blocks its processor",
            ""};
  const double share = period_us > 0.0 ? runtime_us / period_us : 0.0;
  const std::string what =
      "real-time threads get at most " + std::to_string(std::lround(100 * share)) + " % of each second";
  if (share >= enough_share)
    return {"throttling", Health::good, what + ", which is more than the loop needs", ""};
  return {"throttling", Health::poor, what + ", so the loop may be paused for the rest",
          "run sysctl kernel.sched_rt_runtime_us=950000 (with kernel.sched_rt_period_us=1000000)"};
}

Finding siblings(const fs::path& root, int cpu) {
  const std::string number = std::to_string(cpu);
  const std::string core =
      first_line(root / ("sys/devices/system/cpu/cpu" + number + "/topology/thread_siblings_list"));
  if (core.empty())
    return {"core", Health::not_examined, "the kernel does not report which processors share it", ""};
  if (core.find_first_of(",-") == std::string::npos)
    return {"core", Health::good, "processor " + number + " has its own core", ""};
  return {"core", Health::poor,
          "shared by processors " + core + " (SMT): work on the other one slows the loop on " + number,
          "boot with nosmt, or write 0 into /sys/devices/system/cpu/cpuN/online of the other processor N"};
}

/// USB converters that wait for more bytes before they pass on what came: FTDI's for 16 ms as delivered.
Finding usb_latency(const fs::path& root) {
  constexpr int shortest_ms = 1;
  std::string slow;
  std::size_t timers = 0;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(root / "sys/bus/usb-serial/devices", none)) {
    const std::string timer = first_line(entry.path() / "latency_timer");
    if (timer.empty()) continue;
    ++timers;
    if (std::atoi(timer.c_str()) <= shortest_ms) continue;
    slow += (slow.empty() ? "" : ", ") + entry.path().filename().string() + " " + timer + " ms";
  }
  if (timers == 0) return {"USB converters", Health::good, "none has a latency timer", ""};
  if (slow.empty()) return {"USB converters", Health::good, "their latency timers are 1 ms", ""};
  return {
      "USB converters", Health::poor, "replies may be delayed by the converter's latency timer: " + slow,
      "run echo 1 | sudo tee /sys/bus/usb-serial/devices/ttyUSB0/latency_timer; permanently with the udev "
      "rule ACTION==\"add\", SUBSYSTEM==\"usb-serial\", DRIVER==\"ftdi_sio\", ATTR{latency_timer}=\"1\""};
}

/// The processor that the loop would stay on: the last one, as enter_realtime chooses.
int examined_cpu(const fs::path& root) {
  if (const int cpu = loop_cpu({}); root == "/" && cpu >= 0) return cpu;
  const std::string online = first_line(root / "sys/devices/system/cpu/online");
  const std::size_t last = online.find_last_of(",-");
  return std::atoi(last == std::string::npos ? online.c_str() : online.c_str() + last + 1);
}

}  // namespace

std::vector<Finding> examine_machine(const fs::path& root) {
  const int cpu = examined_cpu(root);
  return {kernel(root),     isolation(root),          speed(root),           sleep_states(root),
          tick(root, cpu),  rcu_callbacks(root, cpu), interrupts(root, cpu), siblings(root, cpu),
          throttling(root), usb_latency(root),        priority_limit(),      memory_limit()};
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
