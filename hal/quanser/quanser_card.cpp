#include "quanser_card.hpp"

#include <algorithm>
#include <chrono>
#include <numeric>
#include <thread>
#include <utility>
#include <vector>

#include "card_kinds.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

// The first hil_open may fail after a card was plugged in or a program that used it was killed.
constexpr int attempts_to_open = 3;
constexpr auto pause_between_attempts = std::chrono::milliseconds(300);
// A USB card applies a setting with its next transfers, at the latest after this time.
constexpr auto settling_time = std::chrono::milliseconds(10);

bool is_unsupported(hil::Error error) noexcept {
  return error == -hil::not_supported || error == -hil::function_not_supported ||
         error <= -hil::first_property_not_supported;
}

std::string remedy_for_opening(int number) {
  switch (number) {
    case hil::board_in_use:
      return "end the other program that uses the card";
    case hil::no_permission:
      return "give this user access to the card (udev rules of Quanser's SDK), then plug it in again";
    case hil::unrecognized_board_type:
    case hil::unable_to_open_driver:
      return "check quanser_hil.board_type, and that this version of Quanser's SDK has a driver for the card "
             "(its Linux documentation does not list Q2-USB and Q8-USB)";
    default:
      return "plug the card in, switch it on (lsusb lists a USB card), and check quanser_hil.board_type and "
             "quanser_hil.board_identifier";
  }
}

}  // namespace

RigFault fault_of(hil::Error error) noexcept {
  if (error >= 0) return RigFault::none;
  if (error == -hil::timed_out || error == -hil::would_block || error == -hil::interrupted)
    return RigFault::link_timeout;
  const bool refused_channel = -error >= hil::first_of_channels && -error <= hil::last_of_channels;
  return is_unsupported(error) || refused_channel || error == -hil::no_permission ? RigFault::device_refused
                                                                                  : RigFault::link_lost;
}

QuanserCard::QuanserCard(const RigFile& rig)
    : wiring_(*rig.quanser),
      rig_file_(rig.file.string()),
      amplifier_sign_(rig.amplifier.sign),
      library_(wiring_, rig_file_),
      hil_(library_.functions()) {
  for (const std::optional<int>& channel : {wiring_.cart_channel, wiring_.pendulum_channel})
    if (channel) encoders_[encoder_count_++] = static_cast<unsigned>(*channel);
  require_functions();
  hil::Error error = open_once();
  for (int i = 1; i < attempts_to_open && error < 0; ++i) {
    std::this_thread::sleep_for(pause_between_attempts);
    error = open_once();
  }
  if (error < 0) refuse_opening(error);
}

QuanserCard::~QuanserCard() {
  hil_.close(card_);
}

hil::Error QuanserCard::open_once() {
  const hil::Error error = hil_.open(wiring_.board_type.c_str(), wiring_.board_identifier.c_str(), &card_);
  return error >= 0 && card_ == nullptr ? -hil::board_not_found : error;
}

void QuanserCard::refuse_opening(hil::Error error) const {
  throw DeviceError("the card " + wiring_.board_type + " " + wiring_.board_identifier + " of " + rig_file_ +
                    " cannot be opened (" + library_.words_for(error) + ", in " +
                    std::to_string(attempts_to_open) + " attempts): " + remedy_for_opening(-error));
}

/// An older library, or a substitute, may lack some functions.
void QuanserCard::require_functions() const {
  const auto need = [this](bool is_there, const char* name, const std::string& remedy) {
    if (!is_there)
      throw DeviceError(library_.path() + " of " + rig_file_ + " has no " + name + ": " + remedy);
  };
  if (wiring_.amplifier_enable)
    need(hil_.write_digital != nullptr, "hil_write_digital",
         "install a newer SDK, or remove quanser_hil.amplifier_enable");
  if (wiring_.is_clock)
    need(hil_.task_create_encoder_reader != nullptr && hil_.task_start != nullptr &&
             hil_.task_read_encoder != nullptr && hil_.task_stop != nullptr && hil_.task_delete != nullptr,
         "hil_task functions", "install a newer SDK, or remove quanser_hil.clock");
  if (wiring_.watchdog_s <= 0.0) return;
  need(hil_.watchdog_start != nullptr && hil_.watchdog_reload != nullptr && hil_.watchdog_clear != nullptr &&
           hil_.watchdog_stop != nullptr && hil_.watchdog_set_analog_expiration_state != nullptr,
       "hil_watchdog functions",
       "install a newer SDK, or remove quanser_hil.watchdog_s and protect the amplifier with another "
       "watchdog");
}

void QuanserCard::fail(hil::Error error, const std::string& doing) const {
  throw DeviceError(library_.words_for(error) + " while " + doing + ", card " + wiring_.board_type + " " +
                    wiring_.board_identifier + " of " + rig_file_ +
                    ": check the card, its cable and its channels");
}

void QuanserCard::require(hil::Error error, const std::string& doing) const {
  if (error < 0) fail(error, doing);
}

/// Many cards have this fixed and refuse the setting.
void QuanserCard::require_where_supported(hil::Error error, const std::string& doing) const {
  if (error < 0 && !is_unsupported(error)) fail(error, doing);
}

void QuanserCard::prepare() {
  // Both may be refused if no watchdog runs and the card is not locked.
  stop_watchdog();
  if (hil_.watchdog_clear != nullptr) hil_.watchdog_clear(card_);
  // This comes first, because a card that is unlocked may restore its previous output.
  put_out_zero();
  set_up_output();
  set_up_encoders();
  require_velocities();
  set_up_watchdog();
  std::this_thread::sleep_for(settling_time);
}

void QuanserCard::put_out_zero() const {
  if (!wiring_.output) return;
  require(put_out(0.0), "writing zero volts");
}

void QuanserCard::set_up_output() {
  if (!wiring_.board_options.empty() && hil_.set_card_specific_options != nullptr)
    require(
        hil_.set_card_specific_options(card_, wiring_.board_options.c_str(), wiring_.board_options.size()),
        "setting quanser_hil.board_options");
  if (!wiring_.output) return;
  const auto channel = static_cast<unsigned>(wiring_.output->channel);
  const double zero_v = 0.0;
  if (wiring_.output->sets_range && hil_.set_analog_output_ranges != nullptr) {
    require_where_supported(
        hil_.set_analog_output_ranges(card_, &channel, 1, &wiring_.output->low_v, &wiring_.output->high_v),
        "setting quanser_hil.output_range_v");
    // A new range changes the voltage that the same code means.
    put_out_zero();
  }
  knows_termination_ = hil_.write_termination_states != nullptr &&
                       hil_.set_analog_termination_state != nullptr &&
                       hil_.set_analog_termination_state(card_, &channel, 1, &zero_v) >= 0;
  if (wiring_.amplifier_enable) set_up_enable();
}

void QuanserCard::set_up_enable() {
  const auto line = static_cast<unsigned>(wiring_.amplifier_enable->line);
  if (hil_.set_digital_directions != nullptr)
    require_where_supported(hil_.set_digital_directions(card_, nullptr, 0, &line, 1),
                            "configuring quanser_hil.amplifier_enable as an output");
  require(enable(false), "disabling the amplifier");
  const hil::Boolean off = wiring_.amplifier_enable->active_high ? 0 : 1;
  knows_termination_ = knows_termination_ && hil_.set_digital_termination_state != nullptr &&
                       hil_.set_digital_termination_state(card_, &line, 1, &off) >= 0;
}

void QuanserCard::set_up_encoders() const {
  if (encoder_count_ == 0 || hil_.set_encoder_quadrature_mode == nullptr) return;
  const std::array modes = {hil::quadrature_4x, hil::quadrature_4x};
  require_where_supported(
      hil_.set_encoder_quadrature_mode(card_, encoders_.data(), encoder_count_, modes.data()),
      "setting the encoders to count all four edges");
}

void QuanserCard::require_velocities() const {
  if (!wiring_.reads_velocities) return;
  RawVelocities velocities;
  require(
      read_velocities(velocities),
      "reading the velocities of the encoders (without quanser_hil.encoder_velocities they are not read)");
}

void QuanserCard::set_up_watchdog() const {
  if (wiring_.watchdog_s <= 0.0) return;
  const auto channel = static_cast<unsigned>(wiring_.output->channel);
  const double zero_v = 0.0;
  require(hil_.watchdog_set_analog_expiration_state(card_, &channel, 1, &zero_v),
          "setting the output voltage after an expired watchdog to zero (if the card does not support this, "
          "remove quanser_hil.watchdog_s and use another watchdog)");
  if (hil_.watchdog_set_digital_expiration_state == nullptr) return;
  const QuanserCardKind* kind = quanser_card_kind(wiring_.board_type);
  if (kind != nullptr && kind->tristate_lines > 0) {
    std::vector<unsigned> lines(static_cast<std::size_t>(kind->tristate_lines));
    std::iota(lines.begin(), lines.end(), 0u);
    const std::vector<hil::DigitalState> states(lines.size(), hil::digital_tristate);
    require(hil_.watchdog_set_digital_expiration_state(card_, lines.data(),
                                                       static_cast<unsigned>(lines.size()), states.data()),
            "setting the state of the digital lines after an expired watchdog to tri-state");
    return;
  }
  if (!wiring_.amplifier_enable) return;
  const auto line = static_cast<unsigned>(wiring_.amplifier_enable->line);
  const hil::DigitalState off = wiring_.amplifier_enable->active_high ? hil::digital_low : hil::digital_high;
  require_where_supported(hil_.watchdog_set_digital_expiration_state(card_, &line, 1, &off),
                          "setting the state of the enable line after an expired watchdog to off");
}

void QuanserCard::clear_counts() {
  if (encoder_count_ == 0 || hil_.set_encoder_counts == nullptr) return;
  const std::array<std::int32_t, 2> zeros{};
  require_where_supported(hil_.set_encoder_counts(card_, encoders_.data(), encoder_count_, zeros.data()),
                          "resetting the encoder counters");
  std::this_thread::sleep_for(settling_time);
}

DeviceFacts QuanserCard::facts() const {
  DeviceFacts facts{{"library", library_.path()},
                    {"library_version", library_.version()},
                    {"board_type", wiring_.board_type},
                    {"board_identifier", wiring_.board_identifier}};
  if (hil_.get_string_property == nullptr) return facts;
  const std::array<std::pair<const char*, hil::StringProperty>, 5> asked = {
      {{"manufacturer", hil::manufacturer},
       {"product", hil::product_name},
       {"model", hil::model_name},
       {"serial_number", hil::serial_number},
       {"firmware_version", hil::firmware_version}}};
  for (const auto& [name, property] : asked) {
    std::array<char, 256> text{};
    if (hil_.get_string_property(card_, property, text.data(), text.size()) < 0) continue;
    text.back() = '\0';
    if (text[0] != '\0') facts.emplace_back(name, text.data());
  }
  return facts;
}

/// What was read of the encoders that are wired, in the order of their channels.
template <class Raw, class Value>
Raw QuanserCard::by_encoder(const std::array<Value, 2>& read) const noexcept {
  Raw raw;
  if (wiring_.cart_channel) raw.cart = read[0];
  if (wiring_.pendulum_channel) raw.pendulum = read[encoder_count_ - 1];
  return raw;
}

hil::Error QuanserCard::read_velocities(RawVelocities& velocities) const noexcept {
  if (encoder_count_ == 0 || hil_.read_other == nullptr) return -hil::not_supported;
  std::array<unsigned, 2> channels = encoders_;
  for (unsigned& channel : channels) channel += hil::first_velocity_channel;
  std::array<double, 2> read{};
  const hil::Error error = hil_.read_other(card_, channels.data(), encoder_count_, read.data());
  if (error >= 0) velocities = by_encoder<RawVelocities>(read);
  return error;
}

hil::Error QuanserCard::read_counts(RawCounts& counts) const noexcept {
  std::array<std::int32_t, 2> read{};
  const hil::Error error = hil_.read_encoder(card_, encoders_.data(), encoder_count_, read.data());
  if (error >= 0) counts = by_encoder<RawCounts>(read);
  return error;
}

hil::Task QuanserCard::start_sampling(double rate_hz) const {
  // The newest sample is what a controller needs: the buffer holds one, and a new one takes its place.
  constexpr unsigned samples_in_buffer = 1;
  const std::string remedy = " (without quanser_hil.clock the loop follows the computer's clock)";
  hil::Task task = nullptr;
  require(hil_.task_create_encoder_reader(card_, samples_in_buffer, encoders_.data(), encoder_count_, &task),
          "making a hardware-timed task" + remedy);
  // A card that cannot be told fails where it is not read in time, and the run ends then.
  if (hil_.task_set_buffer_overflow_mode != nullptr)
    hil_.task_set_buffer_overflow_mode(task, hil::overwrite_on_overflow);
  const hil::Error error = hil_.task_start(task, hil::hardware_clock_0, rate_hz, hil::endless);
  if (error >= 0) return task;
  hil_.task_delete(task);
  fail(error, "starting to sample " + exact_text(rate_hz) + " times per second on the card's clock" + remedy);
}

hil::Error QuanserCard::wait_for_sample(hil::Task task, RawCounts& counts) const noexcept {
  std::array<std::int32_t, 2> read{};
  const hil::Error came = hil_.task_read_encoder(task, 1, read.data());
  if (came > 0) counts = by_encoder<RawCounts>(read);
  return came;
}

hil::Error QuanserCard::put_out(double voltage_v) const noexcept {
  const QuanserOutput& output = *wiring_.output;
  const auto channel = static_cast<unsigned>(output.channel);
  const double channel_v =
      std::clamp(amplifier_sign_ * voltage_v / output.amplifier_gain, output.low_v, output.high_v);
  return hil_.write_analog(card_, &channel, 1, &channel_v);
}

hil::Error QuanserCard::enable(bool on) const noexcept {
  if (!wiring_.amplifier_enable) return 0;
  const auto line = static_cast<unsigned>(wiring_.amplifier_enable->line);
  const hil::Boolean level = on == wiring_.amplifier_enable->active_high ? 1 : 0;
  return hil_.write_digital(card_, &line, 1, &level);
}

hil::Error QuanserCard::write_termination_states() const noexcept {
  return knows_termination_ ? hil_.write_termination_states(card_) : -hil::not_supported;
}

bool QuanserCard::has_expired(bool serving_allowed) const noexcept {
  if (wiring_.watchdog_s <= 0.0) return false;
  if (hil_.watchdog_is_expired != nullptr) return hil_.watchdog_is_expired(card_) > 0;
  return serving_allowed && hil_.watchdog_reload(card_) == hil::expired_before;
}

void QuanserCard::stop_watchdog() const noexcept {
  if (hil_.watchdog_stop != nullptr) hil_.watchdog_stop(card_);
}

}  // namespace upright
