// Where an encoder's edges come from: the kernel's interface of version 2, or libgpiod 1 on older kernels.
#pragma once

#include <memory>
#include <string>

#include "chip.hpp"
#include "quadrature.hpp"

namespace upright {

class EdgeSource {
 public:
  virtual ~EdgeSource() = default;
  /// Gives `decoder` the edges at hand, in order; at most as many as the kernel queues. Does not wait.
  /// Returns the decoder's fault or its own.
  virtual RigFault drain(QuadratureDecoder& decoder, std::int64_t now_ns) noexcept = 0;
  /// False when a line cannot be read.
  virtual bool read_levels(LinePair& levels) noexcept = 0;
  /// Edges that the kernel keeps until they are drained, for an encoder that turns one way.
  virtual int queue_edges() const noexcept = 0;
};

/// The kernel's version 2 of the interface: one request for both lines, a queue of 1024 edges, and numbers,
/// which leave no loss unnoticed.
std::unique_ptr<EdgeSource> numbered_edges(const GpioChip& chip, const LineEncoder& encoder,
                                           const std::string& use);
/// libgpiod 1: a queue of 16 edges for each line, merged by their time stamps. A queue that was found full,
/// or edges out of order, count as lost.
std::unique_ptr<EdgeSource> stamped_edges(const GpioChip& chip, const LineEncoder& encoder,
                                          const std::string& use);
/// True where the kernel has version 2.
bool numbers_edges(const GpioChip& chip);

}  // namespace upright
