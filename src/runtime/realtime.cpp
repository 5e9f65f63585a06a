#include "realtime.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace upright {

namespace {

constexpr std::size_t stack_to_touch = 256 * 1024;

__attribute__((noinline)) void touch_stack() {
  volatile char stack[stack_to_touch];
  constexpr std::size_t page = 4096;
  for (std::size_t i = 0; i < stack_to_touch; i += page) stack[i] = 1;
  asm volatile("" : : "r"(stack) : "memory");
}

int last_allowed_cpu() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0 || CPU_COUNT(&allowed) < 2) return -1;
  for (int cpu = CPU_SETSIZE - 1; cpu >= 0; --cpu)
    if (CPU_ISSET(cpu, &allowed)) return cpu;
  return -1;
}

int pin_to(int cpu) {
  if (cpu < 0) return -1;
  cpu_set_t only;
  CPU_ZERO(&only);
  CPU_SET(cpu, &only);
  return pthread_setaffinity_np(pthread_self(), sizeof only, &only) == 0 ? cpu : -1;
}

const char* policy_name(int policy) {
  if (policy == SCHED_FIFO) return "SCHED_FIFO";
  if (policy == SCHED_RR) return "SCHED_RR";
  return policy == SCHED_OTHER ? "SCHED_OTHER" : "another policy";
}

}  // namespace

int loop_cpu(const RealtimeRequest& request) {
  return request.cpu >= 0 ? request.cpu : last_allowed_cpu();
}

void make_way(int cpu) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (cpu >= 0 && sched_getaffinity(0, sizeof allowed, &allowed) == 0 && CPU_ISSET(cpu, &allowed)) {
    CPU_CLR(cpu, &allowed);
    // With no other processor left this fails, and the thread stays where it may be.
    pthread_setaffinity_np(pthread_self(), sizeof allowed, &allowed);
  }
  constexpr int behind = 5;
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), behind);
}

RealtimeGrant enter_realtime(const RealtimeRequest& request) {
  RealtimeGrant grant;
  const bool locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  const int lock_error = errno;
  grant.memory_locked = locked;
  touch_stack();
  sched_param wanted{};
  wanted.sched_priority = request.priority;
  const int refused = pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted);
  sched_param got{};
  int policy = SCHED_OTHER;
  pthread_getschedparam(pthread_self(), &policy, &got);
  grant.policy = policy_name(policy);
  grant.priority = got.sched_priority;
  // Bound to one processor a thread without priority only waits longer for it.
  if (policy == SCHED_FIFO) grant.cpu = pin_to(loop_cpu(request));
  if (policy == SCHED_FIFO)
    grant.note = "SCHED_FIFO priority " + std::to_string(grant.priority) + " granted";
  else
    grant.note = "SCHED_FIFO was not granted (" + std::string(std::strerror(refused)) +
                 "; give the program CAP_SYS_NICE or an rtprio limit); with " + grant.policy +
                 " the loop may wake milliseconds late";
  grant.note += locked ? ", memory locked"
                       : ", memory not locked (" + std::string(std::strerror(lock_error)) +
                             "; give it CAP_IPC_LOCK or a memlock limit)";
  if (grant.cpu >= 0) grant.note += ", on processor " + std::to_string(grant.cpu);
  return grant;
}

std::uint64_t page_faults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return static_cast<std::uint64_t>(usage.ru_minflt + usage.ru_majflt);
}

}  // namespace upright
