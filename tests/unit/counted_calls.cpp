#include "counted_calls.hpp"

#include <dlfcn.h>
#include <pthread.h>
#include <stdlib.h>

#include <utility>

namespace upright::test {

constinit thread_local bool armed = false;
constinit thread_local int allocations = 0;
constinit thread_local int locks = 0;

namespace {

/// The function that this one stands before. The loader may allocate while it looks, which is not counted.
template <class Function>
Function following(const char* name) {
  const bool was_armed = std::exchange(armed, false);
  const auto found = reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
  armed = was_armed;
  return found;
}

}  // namespace
}  // namespace upright::test

using upright::test::allocations;
using upright::test::armed;
using upright::test::following;
using upright::test::locks;

extern "C" {

void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* memory, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
void __libc_free(void* memory);

void* malloc(size_t size) {
  if (armed) ++allocations;
  return __libc_malloc(size);
}
void* calloc(size_t count, size_t size) {
  if (armed) ++allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, size_t size) {
  if (armed) ++allocations;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(size_t alignment, size_t size) {
  if (armed) ++allocations;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, size_t alignment, size_t size) {
  if (armed) ++allocations;
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? 12 : 0;
}
void free(void* memory) {
  if (armed) ++allocations;
  __libc_free(memory);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) {
  using Function = int (*)(pthread_mutex_t*);
  static const Function real = following<Function>("pthread_mutex_lock");
  if (armed) ++locks;
  return real(mutex);
}
int pthread_rwlock_wrlock(pthread_rwlock_t* lock) {
  using Function = int (*)(pthread_rwlock_t*);
  static const Function real = following<Function>("pthread_rwlock_wrlock");
  if (armed) ++locks;
  return real(lock);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* lock) {
  using Function = int (*)(pthread_rwlock_t*);
  static const Function real = following<Function>("pthread_rwlock_rdlock");
  if (armed) ++locks;
  return real(lock);
}
}
