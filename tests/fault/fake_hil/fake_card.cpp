#include "fake_card.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "upright/hal/clock.hpp"

namespace upright::fake_hil {

namespace {

constexpr int timed_out = 14, not_possible_now = 62, board_not_found = 108, board_in_use = 109, refused = 133;
constexpr double low = 0.0, tristate = 2.0, no_change = 3.0;

bool is_of_loop(Call call) {
  return call == Call::read_encoder || call == Call::write_analog || call == Call::watchdog_reload;
}

Reply failed(int number) {
  Reply reply;
  reply.result = -number;
  return reply;
}

const char* property(int number) {
  constexpr std::array texts = {"upright tests", "Fake Q2-USB", "fake-1", "12345", "0.1"};
  return number >= 0 && number < static_cast<int>(texts.size()) ? texts.at(static_cast<std::size_t>(number))
                                                                : "";
}

}  // namespace

FakeCard::FakeCard(const RigFile& rig, const Plant& plant, const VirtualRigOptions& options,
                   const std::filesystem::path& record, const Mishaps& mishaps)
    : rig_(rig), plant_(rig, plant, options), mishaps_(mishaps), record_(record) {
  expire_digital_.fill(no_change);
  expired_ = mishaps.locked_at_start;
  record_ << "monotonic_s,analog_v,enabled,locked\n";
  advance_to(MonotonicClock().now_ns());
}

void FakeCard::advance_to(std::int64_t now_ns) {
  constexpr double for_ever_s = 1e3;
  if (watching_ && !expired_ && (expires_ns_ <= now_ns || is_due(mishaps_.expire_after_s))) {
    now_ns_ = std::clamp(expires_ns_, now_ns_, now_ns);
    plant_.advance_to(now_ns_);
    expire();
  }
  now_ns_ = now_ns;
  plant_.advance_to(now_ns);
  plant_.feed(for_ever_s);
  plant_.trace(false);
}

void FakeCard::expire() {
  expired_ = true;
  mishaps_.expire_after_s = 0.0;
  for (std::size_t i = 0; i < analog_v_.size(); ++i) {
    analog_v_[i] = expire_v_[i];
    if (expire_digital_[i] != no_change)
      digital_[i] = expire_digital_[i] == tristate ? low : expire_digital_[i];
  }
  drive();
}

/// The amplifier: what is on the channel reaches the motor while it is enabled.
void FakeCard::drive() {
  const QuanserRig& wiring = *rig_.quanser;
  const double channel_v = analog_v_.at(static_cast<std::size_t>(wiring.output->channel));
  bool enabled = true;
  if (wiring.amplifier_enable)
    enabled = (digital_.at(static_cast<std::size_t>(wiring.amplifier_enable->line)) > 0.5) ==
              wiring.amplifier_enable->active_high;
  const double motor_v = enabled ? rig_.amplifier.sign * wiring.output->amplifier_gain * channel_v : 0.0;
  if (motor_v != 0.0) plant_.let_go();
  plant_.command(motor_v);
  char line[120];
  std::snprintf(line, sizeof line, "%.6f,%.9g,%d,%d\n", static_cast<double>(now_ns_) * 1e-9, channel_v,
                enabled ? 1 : 0, expired_ ? 1 : 0);
  record_ << line;
  record_.flush();
}

void FakeCard::be_silent(std::int64_t now_ns) {
  silent_until_ns_ = now_ns + static_cast<std::int64_t>(1e9 * mishaps_.silent_s);
}

bool FakeCard::is_unreachable() const {
  return now_ns_ < silent_until_ns_ || is_due(mishaps_.unplug_after_s);
}

double FakeCard::late_s(const Request& request) {
  if (!is_of_loop(request.call) || plant_.held() || mishaps_.late_every == 0) return 0.0;
  return calls_ % mishaps_.late_every == 0 ? mishaps_.late_s : 0.0;
}

std::optional<Reply> FakeCard::mishap_of(const Request& request) {
  if (is_unreachable()) return failed(board_not_found);
  if (!is_of_loop(request.call) || plant_.held()) return std::nullopt;
  ++calls_;
  if (mishaps_.fail_every > 0 && calls_ % mishaps_.fail_every == 0) return failed(timed_out);
  if (request.call == Call::write_analog && is_due(mishaps_.refuse_after_s)) return failed(refused);
  return std::nullopt;
}

Reply FakeCard::open() {
  if (++openings_ <= mishaps_.failed_openings) return failed(board_not_found);
  if (open_) return failed(board_in_use);
  open_ = true;
  return {};
}

Reply FakeCard::answer(const Request& request) {
  if (const std::optional<Reply> mishap = mishap_of(request)) return *mishap;
  Reply reply;
  switch (request.call) {
    case Call::open:
      return open();
    case Call::close:
      open_ = false;
      return reply;
    case Call::get_string:
      std::snprintf(reply.text.data(), reply.text.size(), "%s",
                    property(static_cast<int>(request.values[0])));
      return reply;
    case Call::watchdog_start:
    case Call::watchdog_reload:
    case Call::watchdog_is_expired:
    case Call::watchdog_clear:
    case Call::watchdog_stop:
      act_of_watchdog(request, reply);
      return reply;
    default:
      return expired_ ? failed(not_possible_now) : on_hardware(request);
  }
}

void FakeCard::act_of_watchdog(const Request& request, Reply& reply) {
  switch (request.call) {
    case Call::watchdog_start:
      timeout_s_ = request.values[0];
      watching_ = !expired_;
      break;
    case Call::watchdog_reload:
      reply.result = expired_ ? 0 : 1;
      break;
    case Call::watchdog_is_expired:
      reply.result = expired_ ? 1 : 0;
      return;
    case Call::watchdog_clear:
      expired_ = watching_ = false;
      return;
    default:
      watching_ = false;
      return;
  }
  expires_ns_ = now_ns_ + static_cast<std::int64_t>(1e9 * timeout_s_);
}

/// What an expired watchdog keeps everybody from.
Reply FakeCard::on_hardware(const Request& request) {
  const auto set = [&](std::array<double, lines>& what) {
    for (std::size_t i = 0; i < request.count; ++i) what.at(request.channels[i]) = request.values[i];
  };
  switch (request.call) {
    case Call::read_encoder: {
      const Reply read = counts();
      Reply reply;
      for (std::size_t i = 0; i < request.count; ++i) reply.values[i] = read.values.at(request.channels[i]);
      return reply;
    }
    case Call::read_other:
      return velocities(request);
    case Call::set_counts: {
      const Reply read = counts();
      for (std::size_t i = 0; i < request.count; ++i)
        count_offset_.at(request.channels[i]) +=
            static_cast<std::int64_t>(request.values[i] - read.values.at(request.channels[i]));
      return {};
    }
    case Call::write_analog:
      set(analog_v_);
      drive();
      return {};
    case Call::write_digital:
      set(digital_);
      drive();
      return {};
    case Call::set_analog_expiration:
      set(expire_v_);
      return {};
    case Call::set_digital_expiration:
      set(expire_digital_);
      return {};
    case Call::set_analog_termination:
      set(leave_v_);
      return {};
    case Call::set_digital_termination:
      set(leave_digital_);
      return {};
    case Call::write_termination:
      analog_v_ = leave_v_;
      digital_ = leave_digital_;
      drive();
      return {};
    default:
      return {};
  }
}

Reply FakeCard::counts() {
  EncoderCounts counts = plant_.counts();
  if (is_due(mishaps_.stick_after_s)) {
    if (!stuck_) stuck_ = counts;
    (mishaps_.stick_cart ? counts.cart : counts.pendulum) =
        mishaps_.stick_cart ? stuck_->cart : stuck_->pendulum;
  }
  if (is_due(mishaps_.jump_after_s)) counts.cart += mishaps_.jump_counts;
  const auto shown = [&](int channel, std::int64_t count, const EncoderCalibration& encoder) {
    return static_cast<double>(
        signed_counts(count + count_offset_.at(static_cast<std::size_t>(channel)), encoder.width_bits));
  };
  const QuanserRig& wiring = *rig_.quanser;
  Reply reply;
  reply.values.at(static_cast<std::size_t>(*wiring.cart_channel)) =
      shown(*wiring.cart_channel, counts.cart, rig_.calibration.cart);
  reply.values.at(static_cast<std::size_t>(*wiring.pendulum_channel)) =
      shown(*wiring.pendulum_channel, counts.pendulum, rig_.calibration.pendulum);
  return reply;
}

Reply FakeCard::velocities(const Request& request) const {
  constexpr int no_such_channel = 119, first_channel = 14000;
  if (mishaps_.lacks_velocities) return failed(no_such_channel);
  const std::array<double, 2> counts_per_s = plant_.counts_per_s();
  Reply reply;
  for (std::size_t i = 0; i < request.count; ++i) {
    const int encoder = static_cast<int>(request.channels[i]) - first_channel;
    if (encoder == rig_.quanser->cart_channel)
      reply.values[i] = counts_per_s[0];
    else if (encoder == rig_.quanser->pendulum_channel)
      reply.values[i] = counts_per_s[1];
    else
      return failed(no_such_channel);
  }
  return reply;
}

Reply FakeCard::start_task(const Request& request) {
  if (is_unreachable()) return failed(board_not_found);
  if (expired_) return failed(not_possible_now);
  task_ = request;
  task_.call = Call::read_encoder;
  sample_period_ns_ = 1e9 / request.values[0] * (1.0 + 1e-6 * mishaps_.drift_ppm);
  sample_due_exact_ns_ = static_cast<double>(now_ns_) + sample_period_ns_;
  sample_due_ns_ = static_cast<std::int64_t>(sample_due_exact_ns_);
  return {};
}

std::optional<Reply> FakeCard::sample() {
  if (now_ns_ < sample_due_ns_) return std::nullopt;
  sample_due_exact_ns_ += sample_period_ns_;
  sample_due_ns_ = static_cast<std::int64_t>(sample_due_exact_ns_);
  if (mishaps_.never_samples || is_due(mishaps_.stop_sampling_s)) return std::nullopt;
  if (is_unreachable()) return failed(board_not_found);
  if (!plant_.held() && mishaps_.drop_every > 0 && ++samples_ % mishaps_.drop_every == 0) return std::nullopt;
  return expired_ ? failed(not_possible_now) : on_hardware(task_);
}

namespace {

constexpr std::int64_t step_ns = 1'000'000;

int listening_at(const std::string& path) {
  const int descriptor = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) throw std::runtime_error("too long for a socket: " + path);
  std::copy(path.begin(), path.end(), address.sun_path);
  if (bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(descriptor, 8) != 0)
    throw std::runtime_error("no socket at " + path);
  return descriptor;
}

void wait_until(FakeCard& card, std::int64_t until_ns) {
  MonotonicClock clock;
  while (clock.now_ns() < until_ns) {
    usleep(500);
    card.advance_to(clock.now_ns());
  }
}

/// Who has the card open, and whom its task sends samples.
struct Owners {
  int card = -1, task = -1;
};

/// False: the program at the other end is gone.
bool served(FakeCard& card, int client, Owners& owners) {
  MonotonicClock clock;
  Request request;
  if (recv(client, &request, sizeof request, 0) != sizeof request) return false;
  card.advance_to(clock.now_ns());
  wait_until(card, clock.now_ns() + static_cast<std::int64_t>(1e9 * card.late_s(request)));
  const bool is_task = request.call == Call::task_start;
  const Reply reply = is_task ? card.start_task(request) : card.answer(request);
  if (request.call == Call::open && reply.result >= 0) owners.card = client;
  if (is_task && reply.result >= 0) owners.task = client;
  return send(client, &reply, sizeof reply, MSG_NOSIGNAL) == sizeof reply;
}

void send_sample(FakeCard& card, int task) {
  if (const std::optional<Reply> sample = card.sample())
    // A program that stands still does not stop the card.
    send(task, &*sample, sizeof *sample, MSG_NOSIGNAL | MSG_DONTWAIT);
}

void wait_for_requests(const FakeCard& card, std::vector<pollfd>& open) {
  const std::int64_t until_sample_ns = card.sample_due_ns() - MonotonicClock().now_ns();
  const timespec longest{0, std::clamp<std::int64_t>(until_sample_ns, 0, step_ns)};
  if (ppoll(open.data(), open.size(), &longest, nullptr) < 0)
    for (pollfd& descriptor : open) descriptor.revents = 0;  // a signal came
}

}  // namespace

void serve(FakeCard& card, const std::string& path, const volatile int& stopped,
           const volatile int& silence) {
  MonotonicClock clock;
  std::vector<pollfd> open = {{listening_at(path), POLLIN, 0}};
  std::printf("listening on %s\n", path.c_str());
  std::fflush(stdout);
  Owners owners;
  bool is_silent = false;
  while (stopped == 0) {
    wait_for_requests(card, open);
    card.advance_to(clock.now_ns());
    send_sample(card, owners.task);
    if (silence != 0 && !is_silent) {
      is_silent = true;
      card.be_silent(clock.now_ns());
    }
    for (std::size_t i = open.size(); i-- > 1;) {
      if (open[i].revents == 0 || served(card, open[i].fd, owners)) continue;
      if (open[i].fd == owners.card) card.hang_up();
      if (open[i].fd == owners.task) card.end_task();
      close(open[i].fd);
      open.erase(open.begin() + static_cast<std::ptrdiff_t>(i));
    }
    if (open.front().revents == 0) continue;
    const int client = accept4(open.front().fd, nullptr, nullptr, SOCK_CLOEXEC);
    if (client >= 0) open.push_back({client, POLLIN, 0});
  }
  for (const pollfd& descriptor : open) close(descriptor.fd);
}

}  // namespace upright::fake_hil
