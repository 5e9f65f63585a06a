#include "comedi_rig.hpp"

#include <time.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>

#include "counter_setups.hpp"
#include "hal/reading_patience.hpp"
#include "upright/hal/clock.hpp"

namespace upright {

namespace {

constexpr int attempts_to_stop = 3;
constexpr std::array driver_references = {AREF_GROUND, AREF_COMMON, AREF_DIFF, AREF_OTHER};

RigFault fault_of_comedi_errno(int error) noexcept {
  if (error == ETIMEDOUT || error == ETIME || error == EINTR) return RigFault::link_timeout;
  if (error == EACCES || error == EPERM || error == EBUSY || error == EINVAL) return RigFault::device_refused;
  return RigFault::link_lost;
}

lsampl_t line_select(int line) {
  return static_cast<lsampl_t>(NI_GPCT_PFI_OTHER_SELECT(line));
}

comedi_range as_comedi(const ComediRange& range) {
  return {range.low_v, range.high_v, UNIT_volt};
}

}  // namespace

ComediTransport::ComediTransport(const RigFile& rig, double period_s)
    : rig_(rig), patience_ns_(static_cast<std::int64_t>(1e9 * reading_share_of_period * period_s)) {}

ComediTransport::~ComediTransport() {
  stop();
}

void ComediTransport::open() {
  stop();
  output_ = {};
  encoders_.clear();
  batches_.clear();
  locked_.clear();
  cards_.clear();
  // Otherwise data at either end of a range would come as NaN.
  comedi_set_global_oor_behavior(COMEDI_OOR_NUMBER);
  const ComediRig& wiring = *rig_.comedi;
  if (wiring.output) open_output(*wiring.output);
  if (wiring.cart) open_encoder(*wiring.cart, "cart", rig_.calibration.cart, &RigReading::cart_counts);
  if (wiring.pendulum)
    open_encoder(*wiring.pendulum, "pendulum", rig_.calibration.pendulum, &RigReading::pendulum_counts);
  set_up_ = true;
  stopped_ = false;
}

ComediCard& ComediTransport::card(const std::string& device) {
  for (const auto& open : cards_)
    if (open->device() == device) return *open;
  cards_.push_back(std::make_unique<ComediCard>(device, rig_.file.string()));
  return *cards_.back();
}

void ComediTransport::lock(ComediCard& on, const ComediChannel& at) {
  const std::pair<const ComediCard*, int> wanted{&on, at.subdevice};
  if (std::find(locked_.begin(), locked_.end(), wanted) != locked_.end()) return;
  on.lock(at);
  locked_.push_back(wanted);
}

void ComediTransport::open_output(const ComediOutput& wiring) {
  const ComediChannel at = {"output", wiring.subdevice, wiring.channel};
  ComediCard& on = card(wiring.device);
  on.require(at);
  on.require_type(at, COMEDI_SUBD_AO, "an analog output");
  const unsigned int range_number = on.find_range(at, wiring.range);
  lock(on, at);
  output_ = {on.handle(),
             static_cast<unsigned int>(at.subdevice),
             static_cast<unsigned int>(at.channel),
             range_number,
             as_comedi(wiring.range),
             on.maxdata(at)};
  if (put_out(0.0) != RigFault::none) on.fail(at, "writing zero volts");
}

void ComediTransport::open_encoder(const ComediEncoder& wiring, const char* key,
                                   const EncoderCalibration& calibration, std::int64_t RigReading::*counts) {
  const ComediChannel at = {key, wiring.subdevice, wiring.channel};
  ComediCard& on = card(wiring.device);
  on.require(at);
  lock(on, at);
  Encoder encoder;
  encoder.kind = wiring.kind;
  encoder.counts = counts;
  encoder.width_bits = calibration.width_bits;
  encoder.maxdata = on.maxdata(at);
  unsigned int range_number = 0;
  if (wiring.kind == ComediEncoderKind::analog_input) {
    on.require_type(at, COMEDI_SUBD_AI, "an analog input");
    range_number = on.find_range(at, wiring.range);
    encoder.range = as_comedi(wiring.range);
    encoder.counts_per_v = wiring.counts_per_v;
  } else {
    open_counter(on, at, wiring, encoder);
  }
  comedi_insn& instruction = instructions_[encoders_.size()];
  instruction = {};
  instruction.insn = INSN_READ;
  instruction.n = 1;
  instruction.data = &data_[encoders_.size()];
  instruction.subdev = static_cast<unsigned int>(at.subdevice);
  instruction.chanspec =
      CR_PACK(static_cast<unsigned int>(at.channel), range_number,
              static_cast<unsigned int>(driver_references[static_cast<std::size_t>(wiring.reference)]));
  encoders_.push_back(encoder);
  if (batches_.empty() || batches_.back().device != on.handle())
    batches_.push_back({on.handle(), {0, &instruction}});
  ++batches_.back().list.n_insns;
}

void ComediTransport::open_counter(ComediCard& on, const ComediChannel& at, const ComediEncoder& wiring,
                                   Encoder& encoder) {
  const double range = static_cast<double>(encoder.maxdata) + 1.0;
  if (range != std::ldexp(1.0, encoder.width_bits))
    on.refuse(at, "its data range is 0 to " + std::to_string(encoder.maxdata),
              "set calibration." + std::string(at.key) + ".width_bits to " +
                  std::to_string(std::bit_width(encoder.maxdata)));
  if (wiring.kind == ComediEncoderKind::plain_counter) return;
  const CounterSetup* setup = counter_setup(on.driver());
  if (setup == nullptr)
    on.refuse(at, "the program can set up counters only for the drivers " + known_counter_drivers(),
              "set the counter up with another program and use kind: plain_counter");
  on.require_type(at, COMEDI_SUBD_COUNTER, "a counter");
  if (setup->one_channel && at.channel != 0)
    on.refuse(at, "only channel 0 contains the count", "use channel 0");
  if (setup->has_lines != wiring.lines.has_value())
    on.refuse(at,
              setup->has_lines ? "the counter's input lines must be selected"
                               : "the counter's input lines are fixed",
              setup->has_lines ? "add lines: {a: 8, b: 10} with the PFI lines of A and B" : "remove lines");
  if (setup->begins_anew && !rig_.calibration.zero_at_start)
    on.refuse(at, "the counter is reset at every start, so a zero from an earlier start is invalid",
              "set calibration.zero to {at: start, pose: hanging}");
  encoder.zero = setup->zero;
  if (set_up_) return;
  for (const CounterStep& step : setup->steps) {
    std::array<lsampl_t, 3> data = step.data;
    if (step.line == CounterStep::Line::a) data[step.length - 1] = line_select(wiring.lines->a);
    if (step.line == CounterStep::Line::b) data[step.length - 1] = line_select(wiring.lines->b);
    comedi_insn instruction{};
    instruction.insn = step.instruction;
    instruction.n = step.length;
    instruction.data = data.data();
    instruction.subdev = static_cast<unsigned int>(at.subdevice);
    instruction.chanspec =
        CR_PACK(setup->one_channel ? step.channel : static_cast<unsigned int>(at.channel), 0, 0);
    if (comedi_do_insn(on.handle(), &instruction) < 0 && !step.may_be_refused)
      on.fail(at, "setting up the counter for quadrature");
  }
}

RigReading ComediTransport::read() noexcept {
  RigReading reading;
  const std::int64_t asked_ns = monotonic_ns();
  for (Batch& batch : batches_) {
    const int done = comedi_do_insnlist(batch.device, &batch.list);
    if (done == static_cast<int>(batch.list.n_insns)) continue;
    reading.fault = done < 0 ? fault_of_comedi_errno(comedi_errno()) : RigFault::corrupt_reply;
    return reading;
  }
  const std::int64_t answered_ns = monotonic_ns();
  reading.time_ns = asked_ns + (answered_ns - asked_ns) / 2;
  if (answered_ns - asked_ns > patience_ns_) {
    reading.status = RigStatus::stale;
    reading.fault = RigFault::link_timeout;
    return reading;
  }
  for (std::size_t i = 0; i < encoders_.size(); ++i)
    if (!take(encoders_[i], data_[i], reading)) {
      reading.fault = RigFault::out_of_range;
      return reading;
    }
  reading.sequence = ++sequence_;
  reading.status = RigStatus::fresh;
  return reading;
}

/// False where the data cannot be meant: a potentiometer at either end of the converter's range has no
/// contact.
bool ComediTransport::take(const Encoder& encoder, lsampl_t datum, RigReading& reading) const noexcept {
  std::int64_t& counts = reading.*encoder.counts;
  if (encoder.kind != ComediEncoderKind::analog_input) {
    counts = signed_counts(static_cast<std::int64_t>(datum) - encoder.zero, encoder.width_bits);
    return datum <= encoder.maxdata;
  }
  comedi_range range = encoder.range;
  const double volts = comedi_to_phys(datum, &range, encoder.maxdata);
  counts = std::llround(volts * encoder.counts_per_v);
  return datum > 0 && datum < encoder.maxdata;
}

RigFault ComediTransport::write(double voltage_v) noexcept {
  if (output_.device == nullptr) return RigFault::device_refused;
  if (stopped_) return RigFault::none;
  const RigFault fault = put_out(safe_voltage(voltage_v, rig_.amplifier.limit_v));
  return std::isfinite(voltage_v) ? fault : RigFault::not_finite;
}

/// `voltage_v` is finite: libcomedi would make full negative voltage of a NaN.
RigFault ComediTransport::put_out(double voltage_v) noexcept {
  const double channel_v = std::clamp(rig_.amplifier.sign * voltage_v / rig_.comedi->output->amplifier_gain,
                                      output_.range.min, output_.range.max);
  const lsampl_t datum = comedi_from_phys(channel_v, &output_.range, output_.maxdata);
  const int written = comedi_data_write(output_.device, output_.subdevice, output_.channel,
                                        output_.range_number, AREF_GROUND, datum);
  return written == 1 ? RigFault::none : fault_of_comedi_errno(comedi_errno());
}

/// What a card's driver took is on its output: reading it back would show the driver's own copy only.
StopReport ComediTransport::stop() noexcept {
  stopped_ = true;
  if (output_.device == nullptr) return at_zero_volts();
  StopReport report;
  for (int i = 0; i < attempts_to_stop && !report.zero_confirmed; ++i) {
    report.fault = put_out(0.0);
    report.zero_confirmed = report.fault == RigFault::none;
  }
  return report;
}

}  // namespace upright
