// What one thread allocates and locks. The counters sit in front of the C library's own functions, so that
// whatever calls them, in any library, is seen; sanitizers put their own functions there.
#pragma once

namespace upright::test {

/// Only the thread that arms them counts.
extern constinit thread_local bool armed;
extern constinit thread_local int allocations;
extern constinit thread_local int locks;

}  // namespace upright::test
