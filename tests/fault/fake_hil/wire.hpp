// What travels between the fake libhil.so and the fake card, which is a process of its own as a card is a
// device of its own: it goes on when the controller is killed or stands still.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace upright::fake_hil {

inline constexpr std::size_t max_channels = 32;

enum class Call : std::uint32_t {
  open,
  close,
  get_string,
  set_options,
  set_quadrature,
  set_counts,
  set_ranges,
  set_directions,
  read_encoder,
  read_other,
  write_analog,
  write_digital,
  set_analog_expiration,
  set_digital_expiration,
  watchdog_start,
  watchdog_reload,
  watchdog_is_expired,
  watchdog_clear,
  watchdog_stop,
  set_analog_termination,
  set_digital_termination,
  write_termination,
  /// values[0] is the rate [Hz]. The answer, and then a reply with each sample, until this side hangs up.
  task_start,
};

struct Request {
  Call call = Call::open;
  std::uint32_t count = 0;
  std::array<std::uint32_t, max_channels> channels{};
  std::array<double, max_channels> values{};
  std::array<char, 128> text{};
};

struct Reply {
  std::int32_t result = 0;
  std::array<double, max_channels> values{};
  std::array<char, 128> text{};
};

}  // namespace upright::fake_hil
