#include "hal/virtual_rig.hpp"

#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "endpoint.hpp"
#include "hal/modbus/registers.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/clock.hpp"
#include "virtual_plant.hpp"

namespace upright {

namespace {

constexpr std::int64_t tick_ns = 1'000'000;
constexpr std::int64_t away_ns = 500'000'000;  // a master silent this long has gone
constexpr int server_priority = 60;

void sleep_ns(std::int64_t duration_ns) {
  if (duration_ns <= 0) return;
  const timespec duration{duration_ns / nanoseconds_per_second, duration_ns % nanoseconds_per_second};
  nanosleep(&duration, nullptr);
}

/// The device's registers, as libmodbus serves them.
class Registers {
 public:
  explicit Registers(const ModbusRig& rig) : config_(rig), mapping_(nullptr, modbus_mapping_free) {
    int last = rig.voltage_address + rig.voltage.registers() - 1;
    for (const int address : {rig.cart_address + 1, rig.pendulum_address + 1, rig.enable_address.value_or(0),
                              rig.boot_count_address.value_or(0), rig.watchdog ? rig.watchdog->address : 0})
      last = std::max(last, address);
    const auto count = static_cast<unsigned>(last) + 1;
    mapping_.reset(
        modbus_mapping_new_start_address(0, 0, 0, 0, 0, count, 0, rig.input_registers ? count : 0));
    if (!mapping_) throw DeviceError("the registers could not be allocated: free memory");
  }

  modbus_mapping_t* mapping() const { return mapping_.get(); }

  void show(const EncoderCounts& counts, int boot_count) {
    std::uint16_t* table = config_.input_registers ? mapping_->tab_input_registers : mapping_->tab_registers;
    encode_counter(counts.cart, config_.counter, {table + config_.cart_address, 2});
    encode_counter(counts.pendulum, config_.counter, {table + config_.pendulum_address, 2});
    if (config_.boot_count_address)
      table[*config_.boot_count_address] = static_cast<std::uint16_t>(boot_count);
  }
  double voltage_v() const {
    return decode_voltage({mapping_->tab_registers + config_.voltage_address, 2}, config_.voltage);
  }
  bool has_enable() const { return config_.enable_address.has_value(); }
  bool enabled() const { return !has_enable() || mapping_->tab_registers[*config_.enable_address] != 0; }
  /// 0: not programmed.
  double watchdog_s() const {
    if (!config_.watchdog) return 0.0;
    return mapping_->tab_registers[config_.watchdog->address] * config_.watchdog->seconds_per_count;
  }
  void clear_voltage() {
    for (int i = 0; i < config_.voltage.registers(); ++i)
      mapping_->tab_registers[config_.voltage_address + i] = 0;
  }
  /// As after power-up.
  void reset() {
    clear_voltage();
    if (config_.enable_address) mapping_->tab_registers[*config_.enable_address] = 0;
    if (config_.watchdog) mapping_->tab_registers[config_.watchdog->address] = 0;
  }

 private:
  ModbusRig config_;
  std::unique_ptr<modbus_mapping_t, void (*)(modbus_mapping_t*)> mapping_;
};

class Server {
 public:
  Server(const RigFile& rig, const Plant& plant, const VirtualRigOptions& options)
      : rig_(rig),
        options_(options),
        endpoint_(rig, options),
        registers_(*rig.modbus),
        plant_(rig, plant, options),
        random_(options.faults.seed),
        boot_count_(static_cast<int>(monotonic_ns() / tick_ns & 0xffff)) {
    int pair[2];
    if (socketpair(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0, pair) != 0)
      throw DeviceError("no socket pair can be opened: raise the limit on open files (ulimit -n)");
    reply_in_ = Descriptor(pair[0]);
    reply_out_ = Descriptor(pair[1]);
  }

  // libmodbus closes nothing by itself; the descriptor it last saw belongs to somebody else.
  ~Server() { modbus_set_socket(endpoint_.context(), -1); }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  const std::string& name() const { return endpoint_.name(); }

  void run(const std::atomic<bool>& stopped) {
    const std::int64_t started_ns = monotonic_ns();
    const auto duration_ns = static_cast<std::int64_t>(options_.duration_s * 1e9);
    while (!stopped.load()) {
      wait();
      advance();
      if (!endpoint_.serial()) accept_clients();
      for (Peer& peer : endpoint_.peers()) serve(peer);
      send_due();
      std::erase_if(endpoint_.peers(), [](const Peer& peer) { return peer.gone; });
      maybe_restart();
      maybe_cut();
      if (duration_ns > 0 && monotonic_ns() - started_ns > duration_ns) break;
    }
    advance();
    plant_.command(0.0);
  }

 private:
  void wait() {
    std::vector<pollfd> watched;
    std::int64_t until_ns = monotonic_ns() + tick_ns;
    if (!endpoint_.serial()) watched.push_back({endpoint_.listener(), POLLIN, 0});
    for (const Peer& peer : endpoint_.peers()) {
      watched.push_back({peer.descriptor.get(), POLLIN, 0});
      if (!peer.replies.empty()) until_ns = std::min(until_ns, peer.replies.front().leaves_ns);
    }
    const std::int64_t left_ns = std::max<std::int64_t>(0, until_ns - monotonic_ns());
    const timespec timeout{left_ns / nanoseconds_per_second, left_ns % nanoseconds_per_second};
    ppoll(watched.data(), watched.size(), &timeout, nullptr);
  }

  void advance() {
    const bool was_on = plant_.voltage_v() != 0.0;
    plant_.advance_to(monotonic_ns());
    if (was_on && plant_.voltage_v() == 0.0) registers_.clear_voltage();  // the watchdog's doing
    plant_.trace(false);
  }

  static bool is_due(double after_s, double free_s) { return after_s > 0.0 && free_s >= after_s; }

  /// What the encoders show, right or wrong.
  EncoderCounts shown_counts() {
    const InjectedFaults& faults = options_.faults;
    EncoderCounts counts = plant_.counts();
    if (is_due(faults.stick_after_s, plant_.free_s())) {
      if (!stuck_) stuck_ = counts;
      (faults.stick_cart ? counts.cart : counts.pendulum) =
          faults.stick_cart ? stuck_->cart : stuck_->pendulum;
    }
    if (is_due(faults.jump_after_s, plant_.free_s())) counts.cart += faults.jump_counts;
    return counts;
  }

  bool master_away() const { return monotonic_ns() - plant_.fed_ns() > away_ns; }
  bool motor_off() const { return plant_.voltage_v() == 0.0; }

  void accept_clients() {
    while (endpoint_.accept_client())
      if (!plant_.held() && motor_off() && registers_.has_enable() && !registers_.enabled())
        plant_.put_back();
  }

  static bool has_request(const Peer& peer) {
    pollfd watched{peer.descriptor.get(), POLLIN, 0};
    return poll(&watched, 1, 0) > 0;
  }

  void serve(Peer& peer) {
    if (peer.gone || !has_request(peer)) return;
    modbus_t* context = endpoint_.context();
    std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> request{};
    modbus_set_socket(context, peer.descriptor.get());
    const int length = modbus_receive(context, request.data());
    if (length < 0) {
      if (!endpoint_.serial())
        peer.gone = true;
      else
        modbus_flush(context);
      return;
    }
    if (length == 0) return;  // for another unit
    sleep_ns(endpoint_.line_time_ns(static_cast<std::size_t>(length)));
    advance();
    answer(peer, request, length);
  }

  void answer(Peer& peer, const std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH>& request, int length) {
    if (!plant_.held() && motor_off() && master_away()) plant_.put_back();
    registers_.show(shown_counts(), boot_count_);
    modbus_t* context = endpoint_.context();
    modbus_set_socket(context, reply_in_.get());
    modbus_reply(context, request.data(), length, registers_.mapping());
    Reply reply;
    reply.bytes.resize(MODBUS_TCP_MAX_ADU_LENGTH);
    const ssize_t size = recv(reply_out_.get(), reply.bytes.data(), reply.bytes.size(), MSG_DONTWAIT);
    if (size <= 0) return;
    reply.bytes.resize(static_cast<std::size_t>(size));
    const auto header = static_cast<std::size_t>(modbus_get_header_length(context));
    constexpr std::uint8_t exception_flag = 0x80;
    if ((reply.bytes[header] & exception_flag) == 0) obey();
    queue(peer, std::move(reply));
  }

  /// Takes what a valid request left in the registers.
  void obey() {
    const double programmed_s = registers_.watchdog_s();
    plant_.feed(programmed_s > 0.0 ? programmed_s : rig_.watchdog_s);
    const double voltage_v = registers_.enabled() ? rig_.amplifier.sign * registers_.voltage_v() : 0.0;
    const bool taken_over = registers_.has_enable() ? registers_.enabled() : voltage_v != 0.0;
    if (taken_over) plant_.let_go();
    plant_.command(voltage_v);
  }

  bool hits(int every) {
    if (every <= 0 || plant_.held()) return false;
    return std::uniform_int_distribution<>(1, every)(random_) == 1;
  }

  void queue(Peer& peer, Reply reply) {
    const InjectedFaults& faults = options_.faults;
    reply.leaves_ns = monotonic_ns() + endpoint_.line_time_ns(reply.bytes.size());
    if (hits(faults.late_every)) reply.leaves_ns += static_cast<std::int64_t>(faults.late_s * 1e9);
    if (!peer.replies.empty()) reply.leaves_ns = std::max(reply.leaves_ns, peer.replies.back().leaves_ns);
    if (hits(faults.corrupt_every)) {
      std::uniform_int_distribution<std::size_t> byte(0, reply.bytes.size() - 1);
      std::uniform_int_distribution<> bit(0, 7);
      reply.bytes[byte(random_)] ^= static_cast<std::uint8_t>(1 << bit(random_));
    }
    if (hits(faults.stale_every) && !last_reply_.empty()) reply.bytes = last_reply_;
    last_reply_ = reply.bytes;
    if (cut_ || hits(faults.drop_every)) return;
    if (!peer.withheld && hits(faults.reorder_every)) {
      peer.withheld = std::move(reply);
      return;
    }
    peer.replies.push_back(std::move(reply));
    if (peer.withheld) peer.replies.push_back(std::move(*peer.withheld));
    peer.withheld.reset();
  }

  void send_due() {
    for (Peer& peer : endpoint_.peers()) {
      while (!peer.replies.empty() && peer.replies.front().leaves_ns <= monotonic_ns()) {
        const std::vector<std::uint8_t>& bytes = peer.replies.front().bytes;
        const ssize_t sent = endpoint_.serial() ? ::write(peer.descriptor.get(), bytes.data(), bytes.size())
                                                : ::send(peer.descriptor.get(), bytes.data(), bytes.size(),
                                                         MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent < 0 && !endpoint_.serial()) peer.gone = true;
        peer.replies.pop_front();
      }
    }
  }

  /// From then on no connection lasts and no reply leaves.
  void maybe_cut() {
    if (!cut_ && !is_due(options_.faults.cut_after_s, plant_.free_s())) return;
    cut_ = true;
    if (!endpoint_.serial()) endpoint_.peers().clear();
  }

  void maybe_restart() {
    if (restarted_ || !is_due(options_.faults.restart_after_s, plant_.free_s())) return;
    restarted_ = true;
    boot_count_ = (boot_count_ + 1) & 0xffff;
    registers_.reset();
    plant_.command(0.0);
    for (Peer& peer : endpoint_.peers()) {
      peer.replies.clear();
      peer.gone = !endpoint_.serial();
    }
    std::erase_if(endpoint_.peers(), [](const Peer& peer) { return peer.gone; });
  }

  const RigFile& rig_;
  const VirtualRigOptions& options_;
  Endpoint endpoint_;
  Registers registers_;
  VirtualPlant plant_;
  std::mt19937_64 random_;
  int boot_count_;
  bool restarted_ = false, cut_ = false;
  std::optional<EncoderCounts> stuck_;  // the counts an encoder stopped at
  std::vector<std::uint8_t> last_reply_;
  Descriptor reply_in_, reply_out_;  // libmodbus writes its reply into one, we take it from the other
};

}  // namespace

void serve_virtual_rig(const RigFile& rig, const Plant& plant, const VirtualRigOptions& options,
                       const std::atomic<bool>& stopped) {
  if (!roles_of(rig, Backend::modbus_tcp).all() && !roles_of(rig, Backend::modbus_rtu).all())
    throw ConfigError(rig.file.string() + ":1: backend is " + backends_text(rig) +
                      ": use a rig file whose only backend is modbus-tcp or modbus-rtu");
  Server server(rig, plant, options);
  const sched_param parameters{server_priority};
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);  // where allowed
  if (options.listening) options.listening(server.name());
  server.run(stopped);
}

}  // namespace upright
