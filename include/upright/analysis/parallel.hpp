// Work spread over the cores. Results must not depend on how many there are: each index writes its own place.
#pragma once

#include <cstddef>
#include <functional>

namespace upright {

/// Threads to use: the machine's cores, or what UPRIGHT_THREADS says.
unsigned thread_count();

/// Calls work(i) for i in [0, count) on all cores; rethrows the first exception in index order.
void parallel_for(std::size_t count, const std::function<void(std::size_t)>& work);

}  // namespace upright
