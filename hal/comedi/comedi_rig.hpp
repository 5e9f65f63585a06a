// A rig on Comedi devices, or the parts of one that are.
//
// Each call is an ioctl in the loop's own thread; what is known of how long it takes: libcomedi adds neither
// memory nor locks. The kernel takes the device's mutex, so that another program's call to the same device is
// waited for, and runs the driver. Counters and analog outputs of the drivers in the table are register
// accesses, which wait for nothing but the bus. An analog input is waited for until its conversion is over;
// where the hardware does not answer, drivers give up after a second (COMEDI_TIMEOUT_MS) at the latest. So a
// reading that took longer than most of a period is stale; and a card that hangs makes a cycle late by up to
// a second for each of its channels, which the loop counts as missed periods and ends at zero volts, but
// cannot prevent.
#pragma once

#include <comedilib.h>

#include <array>
#include <memory>
#include <vector>

#include "card.hpp"
#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

class ComediTransport final : public Rig {
 public:
  ComediTransport(const RigFile& rig, double period_s);
  ~ComediTransport() override;
  ComediTransport(const ComediTransport&) = delete;
  ComediTransport& operator=(const ComediTransport&) = delete;

  /// Locks the subdevices it uses, so that a second controller is refused, and puts out zero volts first of
  /// all.
  void open() override;
  RigReading read() noexcept override;
  RigFault write(double voltage_v) noexcept override;
  StopReport stop() noexcept override;

 private:
  /// What an open encoder's data mean.
  struct Encoder {
    ComediEncoderKind kind = ComediEncoderKind::counter;
    std::int64_t RigReading::*counts = nullptr;
    int width_bits = 32;
    std::int64_t zero = 0;  // a counter's reading when it has counted nothing
    lsampl_t maxdata = 0;
    comedi_range range{};
    double counts_per_v = 0.0;
  };
  /// Encoders on one device, read by one call.
  struct Batch {
    comedi_t* device = nullptr;
    comedi_insnlist list{};
  };
  struct Output {
    comedi_t* device = nullptr;
    unsigned int subdevice = 0, channel = 0, range_number = 0;
    comedi_range range{};
    lsampl_t maxdata = 0;
  };

  ComediCard& card(const std::string& device);
  void lock(ComediCard& on, const ComediChannel& at);
  void open_output(const ComediOutput& wiring);
  void open_encoder(const ComediEncoder& wiring, const char* key, const EncoderCalibration& calibration,
                    std::int64_t RigReading::*counts);
  void open_counter(ComediCard& on, const ComediChannel& at, const ComediEncoder& wiring, Encoder& encoder);
  bool take(const Encoder& encoder, lsampl_t datum, RigReading& reading) const noexcept;
  RigFault put_out(double voltage_v) noexcept;

  RigFile rig_;
  std::int64_t patience_ns_;
  std::vector<std::unique_ptr<ComediCard>> cards_;
  std::vector<std::pair<const ComediCard*, int>> locked_;
  std::vector<Encoder> encoders_;
  std::array<comedi_insn, 2> instructions_{};  // of the encoders, in their order
  std::array<lsampl_t, 2> data_{};
  std::vector<Batch> batches_;
  Output output_;
  std::uint64_t sequence_ = 0;
  bool set_up_ = false;  // the counters, which opening again must not clear
  bool stopped_ = false;
};

}  // namespace upright
