// A card that samples on its own time, and the thread that takes its samples.
//
// The library waits for a sample without a bound, and only the thread waits with it. The loop waits for the
// thread, with a bound of its own: a card that stops sampling is a link that gives no reply.
#pragma once

#include <cstdint>
#include <string>
#include <thread>

#include "../sample_ring.hpp"
#include "quanser_card.hpp"

namespace upright {

class QuanserSampler {
 public:
  /// Starts to sample, and waits until it is known that the card does so every `period_s`. Throws DeviceError
  /// where it does not. `card` must outlive this.
  QuanserSampler(QuanserCard& card, double period_s, const std::string& rig_file);
  ~QuanserSampler();
  QuanserSampler(const QuanserSampler&) = delete;
  QuanserSampler& operator=(const QuanserSampler&) = delete;

  /// The trouble of a sample is the error, negative, with which the card has ended sampling.
  const SampleRing& samples() const noexcept { return samples_; }

 private:
  void take_samples() noexcept;
  void end() noexcept;
  void require_period(double period_s, const std::string& rig_file) const;
  double measured_period_s(double period_s, const std::string& rig_file) const;

  QuanserCard& card_;
  hil::Task task_;
  SampleRing samples_;
  std::thread thread_;
};

}  // namespace upright
