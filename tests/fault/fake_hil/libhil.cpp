// A libhil.so of the tests' own: the functions of the public C interface, each of which asks the fake card at
// the socket that the board identifier names, "0@unix:PATH".
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "../../../hal/quanser/hil.hpp"
#include "wire.hpp"

using upright::fake_hil::Call;
using upright::fake_hil::Reply;
using upright::fake_hil::Request;
namespace hil = upright::hil;

struct upright::hil::CardTag {
  int socket = -1;
  std::string identifier;
};

/// A connection of its own, over which the card sends its samples when it takes them.
struct upright::hil::TaskTag {
  int socket = -1;
  std::vector<unsigned> channels;
  bool overwrites = false;
};

namespace {

constexpr int connection_gone = 44, buffer_overflow = 111;

int connected_to(const char* identifier) {
  const char* at = std::strstr(identifier, "@unix:");
  if (at == nullptr) return -1;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, at + std::strlen("@unix:"), sizeof address.sun_path - 1);
  const int descriptor = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  if (connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    return descriptor;
  close(descriptor);
  return -1;
}

Reply asked(int socket, const Request& request) {
  Reply reply;
  if (send(socket, &request, sizeof request, MSG_NOSIGNAL) != sizeof request ||
      recv(socket, &reply, sizeof reply, 0) != sizeof reply)
    reply.result = -connection_gone;
  return reply;
}

Reply asked(hil::Card card, const Request& request) {
  return asked(card->socket, request);
}

template <class Value>
Request request_for(Call call, hil::Channels channels, unsigned count, const Value* values) {
  Request request;
  request.call = call;
  request.count = std::min<unsigned>(count, upright::fake_hil::max_channels);
  for (unsigned i = 0; i < request.count; ++i) {
    request.channels[i] = channels[i];
    if (values != nullptr) request.values[i] = static_cast<double>(values[i]);
  }
  return request;
}

template <class Value>
hil::Error tell(hil::Card card, Call call, hil::Channels channels, unsigned count, const Value* values) {
  return asked(card, request_for(call, channels, count, values)).result;
}

template <class Value>
hil::Error ask(hil::Card card, Call call, hil::Channels channels, unsigned count, Value* values) {
  const Reply reply = asked(card, request_for<Value>(call, channels, count, nullptr));
  if (reply.result < 0) return reply.result;
  for (unsigned i = 0; i < std::min<unsigned>(count, upright::fake_hil::max_channels); ++i)
    values[i] = static_cast<Value>(reply.values[i]);
  return reply.result;
}

hil::Error tell(hil::Card card, Call call, double value = 0.0) {
  Request request;
  request.call = call;
  request.values[0] = value;
  return asked(card, request).result;
}

}  // namespace

extern "C" {

hil::Error hil_open(const char* type, const char* identifier, hil::Card* card) {
  const int descriptor = connected_to(identifier);
  if (descriptor < 0) return -hil::board_not_found;
  *card = new hil::CardTag{descriptor, identifier};
  Request request;
  std::strncpy(request.text.data(), type, request.text.size() - 1);
  const hil::Error result = asked(*card, request).result;
  if (result >= 0) return result;
  close(descriptor);
  delete *card;
  *card = nullptr;
  return result;
}

hil::Error hil_close(hil::Card card) {
  const hil::Error result = tell(card, Call::close);
  close(card->socket);
  delete card;
  return result;
}

hil::Error hil_get_version(hil::Version* version) {
  version->major = 9;
  version->minor = 8;
  version->release = 7;
  return 0;
}

hil::Error hil_get_string_property(hil::Card card, hil::StringProperty property, char* text,
                                   std::size_t size) {
  Request request;
  request.call = Call::get_string;
  request.values[0] = property;
  const Reply reply = asked(card, request);
  if (reply.result >= 0) std::snprintf(text, size, "%s", reply.text.data());
  return reply.result;
}

hil::Error hil_set_card_specific_options(hil::Card card, const char* options, std::size_t size) {
  Request request;
  request.call = Call::set_options;
  std::memcpy(request.text.data(), options, std::min(size, request.text.size() - 1));
  return asked(card, request).result;
}

hil::Error hil_set_encoder_quadrature_mode(hil::Card card, hil::Channels channels, unsigned count,
                                           const hil::QuadratureMode* modes) {
  return tell(card, Call::set_quadrature, channels, count, modes);
}
hil::Error hil_set_encoder_counts(hil::Card card, hil::Channels channels, unsigned count,
                                  const std::int32_t* counts) {
  return tell(card, Call::set_counts, channels, count, counts);
}
hil::Error hil_set_analog_output_ranges(hil::Card card, hil::Channels channels, unsigned count, const double*,
                                        const double* high) {
  return tell(card, Call::set_ranges, channels, count, high);
}
hil::Error hil_set_digital_directions(hil::Card card, hil::Channels, unsigned, hil::Channels outputs,
                                      unsigned count) {
  return tell<double>(card, Call::set_directions, outputs, count, nullptr);
}
hil::Error hil_read_encoder(hil::Card card, hil::Channels channels, unsigned count, std::int32_t* counts) {
  return ask(card, Call::read_encoder, channels, count, counts);
}
hil::Error hil_read_other(hil::Card card, hil::Channels channels, unsigned count, double* values) {
  return ask(card, Call::read_other, channels, count, values);
}
hil::Error hil_write_analog(hil::Card card, hil::Channels channels, unsigned count, const double* volts) {
  return tell(card, Call::write_analog, channels, count, volts);
}
hil::Error hil_write_digital(hil::Card card, hil::Channels lines, unsigned count,
                             const hil::Boolean* levels) {
  return tell(card, Call::write_digital, lines, count, levels);
}
hil::Error hil_watchdog_set_analog_expiration_state(hil::Card card, hil::Channels channels, unsigned count,
                                                    const double* volts) {
  return tell(card, Call::set_analog_expiration, channels, count, volts);
}
hil::Error hil_watchdog_set_digital_expiration_state(hil::Card card, hil::Channels lines, unsigned count,
                                                     const hil::DigitalState* states) {
  return tell(card, Call::set_digital_expiration, lines, count, states);
}
hil::Error hil_watchdog_start(hil::Card card, double timeout_s) {
  return tell(card, Call::watchdog_start, timeout_s);
}
hil::Error hil_watchdog_reload(hil::Card card) {
  return tell(card, Call::watchdog_reload);
}
hil::Error hil_watchdog_is_expired(hil::Card card) {
  return tell(card, Call::watchdog_is_expired);
}
hil::Error hil_watchdog_clear(hil::Card card) {
  return tell(card, Call::watchdog_clear);
}
hil::Error hil_watchdog_stop(hil::Card card) {
  return tell(card, Call::watchdog_stop);
}
hil::Error hil_set_analog_termination_state(hil::Card card, hil::Channels channels, unsigned count,
                                            const double* volts) {
  return tell(card, Call::set_analog_termination, channels, count, volts);
}
hil::Error hil_set_digital_termination_state(hil::Card card, hil::Channels lines, unsigned count,
                                             const hil::Boolean* levels) {
  return tell(card, Call::set_digital_termination, lines, count, levels);
}
hil::Error hil_write_termination_states(hil::Card card) {
  return tell(card, Call::write_termination);
}

hil::Error hil_task_create_encoder_reader(hil::Card card, unsigned samples_in_buffer, hil::Channels channels,
                                          unsigned count, hil::Task* task) {
  if (samples_in_buffer != 1) return -hil::not_supported;
  const int descriptor = connected_to(card->identifier.c_str());
  if (descriptor < 0) return -hil::board_not_found;
  *task = new hil::TaskTag{descriptor, {channels, channels + count}};
  return 0;
}
hil::Error hil_task_set_buffer_overflow_mode(hil::Task task, hil::BufferOverflowMode mode) {
  task->overwrites = mode == hil::overwrite_on_overflow;
  return 0;
}
hil::Error hil_task_start(hil::Task task, hil::Clock, double rate_hz, unsigned) {
  Request request = request_for<double>(Call::task_start, task->channels.data(),
                                        static_cast<unsigned>(task->channels.size()), nullptr);
  request.values[0] = rate_hz;
  return asked(task->socket, request).result;
}
hil::Error hil_task_read_encoder(hil::Task task, unsigned, std::int32_t* counts) {
  Reply reply;
  const ssize_t came = recv(task->socket, &reply, sizeof reply, 0);
  if (came == 0) return 0;  // stopped
  if (came != sizeof reply) return -connection_gone;
  // The buffer holds one sample.
  while (recv(task->socket, &reply, sizeof reply, MSG_DONTWAIT) == sizeof reply)
    if (!task->overwrites) return -buffer_overflow;
  if (reply.result < 0) return reply.result;
  for (std::size_t i = 0; i < task->channels.size(); ++i)
    counts[i] = static_cast<std::int32_t>(reply.values.at(i));
  return 1;
}
hil::Error hil_task_stop(hil::Task task) {
  shutdown(task->socket, SHUT_RDWR);
  return 0;
}
hil::Error hil_task_delete(hil::Task task) {
  close(task->socket);
  delete task;
  return 0;
}

}  // extern "C"
