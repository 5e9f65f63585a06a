// Emergency stop, limit switches, amplifier enable and heartbeat, around any rig.
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "chip.hpp"
#include "hal/gpio_rig.hpp"

namespace upright {

namespace {

struct Input {
  DigitalLine line;
  RigFault fault;
  std::string use;
};

/// Inputs of one bias: libgpiod asks for a bias per request, and reads a request's lines with one call.
struct InputGroup {
  gpiod_line_bulk lines;
  std::vector<Input> inputs;
};

/// In the order in which they are named when several are active.
std::vector<Input> inputs_of(const GpioRig& rig) {
  std::vector<Input> inputs;
  if (rig.emergency_stop) inputs.push_back({*rig.emergency_stop, RigFault::emergency_stop, "emergency_stop"});
  for (const LimitSwitch& limit : rig.limit_switches)
    inputs.push_back(
        {limit.line,
         limit.end == TrackEnd::plus_x ? RigFault::limit_switch_plus : RigFault::limit_switch_minus,
         "limit_switches"});
  return inputs;
}

/// Which of several faults is told: the lowest.
int rank(RigFault fault) noexcept {
  switch (fault) {
    case RigFault::emergency_stop:
      return 0;
    case RigFault::line_failed:
      return 1;
    case RigFault::none:
      return 3;
    default:
      return 2;
  }
}

class Output {
 public:
  Output(const GpioChip& chip, int number, bool active_high, const std::string& use)
      : line_(chip.line(number, use)), active_high_(active_high) {
    if (gpiod_line_request_output(line_, gpio_consumer, active_high ? 0 : 1) != 0) chip.refuse(number, use);
  }
  bool set(bool is_active) noexcept {
    return gpiod_line_set_value(line_, is_active == active_high_ ? 1 : 0) == 0;
  }

 private:
  gpiod_line* line_;
  bool active_high_;
};

/// The lines themselves, held as long as this lives.
class GpioLines {
 public:
  GpioLines(const GpioRig& config, const std::string& file) : chip_(config.chip, file) {
    for (Input& input : inputs_of(config)) {
      InputGroup& group = groups_[static_cast<std::size_t>(input.line.bias)];
      if (group.inputs.empty()) gpiod_line_bulk_init(&group.lines);
      gpiod_line_bulk_add(&group.lines, chip_.line(input.line.line, input.use));
      group.inputs.push_back(std::move(input));
    }
    for (InputGroup& group : groups_) {
      if (group.inputs.empty()) continue;
      const Input& first = group.inputs.front();
      if (gpiod_line_request_bulk_input_flags(&group.lines, gpio_consumer, bias_flag(first.line.bias)) != 0)
        chip_.refuse(first.line.line, first.use);
    }
    if (const auto& enable = config.amplifier_enable)
      enable_.emplace(chip_, enable->line, enable->active_high, "amplifier_enable");
    if (config.heartbeat) heartbeat_.emplace(chip_, *config.heartbeat, true, "heartbeat");
  }

  /// The most urgent fault of all inputs.
  RigFault read() noexcept {
    RigFault worst = RigFault::none;
    const auto worsen = [&worst](RigFault fault) {
      if (rank(fault) < rank(worst)) worst = fault;
    };
    for (InputGroup& group : groups_) {
      if (group.inputs.empty()) continue;
      std::array<int, GPIOD_LINE_BULK_MAX_LINES> values{};
      if (gpiod_line_get_value_bulk(&group.lines, values.data()) != 0) {
        worsen(RigFault::line_failed);
        continue;
      }
      for (std::size_t i = 0; i < group.inputs.size(); ++i)
        if ((values[i] != 0) == group.inputs[i].line.active_high) worsen(group.inputs[i].fault);
    }
    return worst;
  }

  /// True where there is no such line.
  bool enable(bool is_enabled) noexcept { return !enable_ || enable_->set(is_enabled); }
  bool beat() noexcept {
    beat_ = !beat_;
    return !heartbeat_ || heartbeat_->set(beat_);
  }

 private:
  GpioChip chip_;
  std::array<InputGroup, 3> groups_{};
  std::optional<Output> enable_, heartbeat_;
  bool beat_ = false;
};

class GpioLinesRig final : public Rig {
 public:
  GpioLinesRig(std::unique_ptr<Rig> rig, const RigFile& file)
      : rig_(std::move(rig)), config_(*file.gpio), file_(file.file.string()) {}
  ~GpioLinesRig() override {
    if (lines_) lines_->enable(false);
  }

  void open() override {
    // The lines first: they keep the amplifier off while the rest begins.
    if (!lines_) lines_.emplace(config_, file_);
    rest();
    rig_->open();
    rests_ = false;
  }

  RigReading read() noexcept override {
    RigReading reading = rig_->read();
    if (const RigFault fault = lines_->read(); fault != RigFault::none) {
      reading.status = RigStatus::fault;
      reading.fault = fault;
    }
    return reading;
  }

  RigFault write(double voltage_v) noexcept override {
    const RigFault fault = rig_->write(voltage_v);
    if (fault != RigFault::none || rests_) return fault;
    if (!is_enabled_) is_enabled_ = lines_->enable(true);
    // No beat without an amplifier that obeys, so that the external watchdog does not trust it.
    return is_enabled_ && lines_->beat() ? RigFault::none : RigFault::line_failed;
  }

  StopReport stop() noexcept override {
    const bool is_disabled = rest();
    StopReport report = rig_->stop();
    if (is_disabled) return report;
    report.disabled = false;
    if (report.fault == RigFault::none) report.fault = RigFault::line_failed;
    return report;
  }

  void moved_by_hand() noexcept override { rig_->moved_by_hand(); }
  int last_exception() const noexcept override { return rig_->last_exception(); }
  DeviceFacts device_facts() const override { return rig_->device_facts(); }
  bool measures_velocities() const noexcept override { return rig_->measures_velocities(); }
  bool is_clock() const noexcept override { return rig_->is_clock(); }
  DeviceSample wait_next(std::int64_t until_ns) noexcept override { return rig_->wait_next(until_ns); }

  SafetyInputs safety_inputs() const noexcept override {
    return {config_.emergency_stop.has_value(), static_cast<int>(config_.limit_switches.size())};
  }

 private:
  /// False: the line did not take it.
  bool rest() noexcept {
    rests_ = true;
    is_enabled_ = false;
    return !lines_ || lines_->enable(false);
  }

  std::unique_ptr<Rig> rig_;
  GpioRig config_;
  std::string file_;
  std::optional<GpioLines> lines_;
  bool is_enabled_ = false;
  bool rests_ = true;
};

}  // namespace

std::unique_ptr<Rig> with_gpio_lines(std::unique_ptr<Rig> rig, const RigFile& file) {
  const bool any = file.gpio && (file.gpio->emergency_stop || !file.gpio->limit_switches.empty() ||
                                 file.gpio->amplifier_enable || file.gpio->heartbeat);
  if (!any) return rig;
  return std::make_unique<GpioLinesRig>(std::move(rig), file);
}

}  // namespace upright
