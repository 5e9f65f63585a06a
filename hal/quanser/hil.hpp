// The part of Quanser's HIL interface that is used here, in declarations of our own: the library is loaded
// when a rig asks for it, and no header of Quanser's is needed to build.
//
// Types and signatures follow two public sources under the MIT licence that call the same functions:
//   JuliaComputing/QuanserInterface.jl, src/QuanserBindings.jl (types, values, every signature)
//   mahilab/mahi-daq, src/Mahi/Daq/Quanser/*.cpp (order of the calls on Q2-USB and Q8-USB, what reload
//   returns, hil_get_version, msg_get_error_message)
//   quanser/quanser_sdk_examples, C/hardware/position_control_example (the loop that a hardware-timed task
//   paces: hil_task_read_encoder, then hil_write_analog)
// What an expired watchdog does, and what a task's buffer does when it is full, follows Quanser's
// documentation: it sets the outputs to their expiration states and keeps everybody from the hardware until
// it is cleared.
#pragma once

#include <cstddef>
#include <cstdint>

namespace upright::hil {

struct CardTag;
using Card = CardTag*;  // t_card
struct TaskTag;
using Task = TaskTag*;             // t_task
using Error = int;                 // t_error: negative on error
using Boolean = char;              // t_boolean
using Channels = const unsigned*;  // t_uint32[]

struct Version {  // t_version
  std::uint32_t size = sizeof(Version);
  std::uint16_t major = 0, minor = 0, release = 0, build = 0;
};

enum StringProperty : unsigned {
  manufacturer = 0,
  product_name,
  model_name,
  serial_number,
  firmware_version
};
enum QuadratureMode : unsigned { quadrature_4x = 4 };
enum DigitalState : unsigned { digital_low = 0, digital_high = 1, digital_tristate = 2 };

enum Clock : int { hardware_clock_0 = 0 };
enum BufferOverflowMode : unsigned { overwrite_on_overflow = 1 };
inline constexpr auto endless = static_cast<unsigned>(-1);  // number of samples of a task

/// hil_read_other: the encoders' velocities in counts per second.
inline constexpr unsigned first_velocity_channel = 14000;

// Numbers of errors, which functions return negated.
inline constexpr int not_supported = 6, no_permission = 11, timed_out = 14, would_block = 34,
                     interrupted = 35, function_not_supported = 94, unable_to_open_driver = 107,
                     board_not_found = 108, board_in_use = 109, first_of_channels = 119,
                     last_of_channels = 143, unrecognized_board_type = 179,
                     first_property_not_supported = 439;
// Of the watchdog's functions.
inline constexpr int reloaded = 1, expired_before = 0;

/// Pointers into the library. Null: this library does not have the function.
struct Functions {
  Error (*open)(const char* type, const char* identifier, Card* card) = nullptr;
  Error (*close)(Card) = nullptr;
  Error (*get_version)(Version*) = nullptr;
  Error (*get_string_property)(Card, StringProperty, char* text, std::size_t size) = nullptr;
  Error (*set_card_specific_options)(Card, const char* options, std::size_t size) = nullptr;
  Error (*set_encoder_quadrature_mode)(Card, Channels, unsigned count, const QuadratureMode*) = nullptr;
  Error (*set_encoder_counts)(Card, Channels, unsigned count, const std::int32_t*) = nullptr;
  Error (*set_analog_output_ranges)(Card, Channels, unsigned count, const double* low,
                                    const double* high) = nullptr;
  Error (*set_digital_directions)(Card, Channels inputs, unsigned input_count, Channels outputs,
                                  unsigned output_count) = nullptr;
  Error (*read_encoder)(Card, Channels, unsigned count, std::int32_t*) = nullptr;
  Error (*read_other)(Card, Channels, unsigned count, double*) = nullptr;
  Error (*write_analog)(Card, Channels, unsigned count, const double*) = nullptr;
  Error (*write_digital)(Card, Channels, unsigned count, const Boolean*) = nullptr;
  Error (*watchdog_set_analog_expiration_state)(Card, Channels, unsigned count, const double*) = nullptr;
  Error (*watchdog_set_digital_expiration_state)(Card, Channels, unsigned count,
                                                 const DigitalState*) = nullptr;
  Error (*watchdog_start)(Card, double timeout_s) = nullptr;
  Error (*watchdog_reload)(Card) = nullptr;
  Error (*watchdog_is_expired)(Card) = nullptr;
  Error (*watchdog_clear)(Card) = nullptr;
  Error (*watchdog_stop)(Card) = nullptr;
  Error (*set_analog_termination_state)(Card, Channels, unsigned count, const double*) = nullptr;
  Error (*set_digital_termination_state)(Card, Channels, unsigned count, const Boolean*) = nullptr;
  Error (*write_termination_states)(Card) = nullptr;
  Error (*task_create_encoder_reader)(Card, unsigned samples_in_buffer, Channels, unsigned count,
                                      Task*) = nullptr;
  Error (*task_set_buffer_overflow_mode)(Task, BufferOverflowMode) = nullptr;
  Error (*task_start)(Task, Clock, double rate_hz, unsigned samples) = nullptr;
  /// Waits for `samples` samples, or until the task is stopped. Returns how many came.
  Error (*task_read_encoder)(Task, unsigned samples, std::int32_t*) = nullptr;
  Error (*task_stop)(Task) = nullptr;
  Error (*task_delete)(Task) = nullptr;
  /// What it returns is not used.
  void (*get_error_message)(const char* locale, Error, char* text, std::size_t size) = nullptr;
};

}  // namespace upright::hil
