#include "live_server.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <list>
#include <random>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "base/palette.hpp"
#include "http_connection.hpp"
#include "runtime/realtime.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

using namespace std::chrono_literals;
using Time = HttpConnection::Time;

constexpr std::string_view page_text =
#include "live_page.inc"
    ;

/// Each open page is sent some 12 kB/s; more of them than a class needs would only take time from the log.
constexpr std::size_t max_streams = 6;
/// Overdue connections are looked for at least so often.
constexpr auto longest_pause = 100ms;
/// Few enough that none that is taken gives way to another before its request was looked at twice.
constexpr std::size_t max_accepted_at_once = LiveServer::max_connections / 4;
/// Connections that the kernel holds for us until we take them.
constexpr int backlog = 512;
constexpr std::string_view token_header = "X-Upright-Token";

std::string random_token() {
  std::random_device device;
  std::string token;
  for (int i = 0; i < 4; ++i) {
    char part[9];
    std::snprintf(part, sizeof part, "%08x", static_cast<unsigned>(device()));
    token += part;
  }
  return token;
}

std::string replaced(std::string text, std::string_view what, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
  return text;
}

const char* words_for(HttpStatus status) {
  switch (status) {
    case HttpStatus::ok:
      return "OK";
    case HttpStatus::bad_request:
      return "Bad Request";
    case HttpStatus::forbidden:
      return "Forbidden";
    case HttpStatus::not_found:
      return "Not Found";
    case HttpStatus::head_too_large:
      return "Request Header Fields Too Large";
    case HttpStatus::too_many_pages:
      return "Service Unavailable";
  }
  return "OK";
}

/// The socket that connections come in by: on the loopback address, not shared with another program.
class Listener {
 public:
  explicit Listener(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    const int yes = 1;
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    socklen_t size = sizeof address;
    if (socket_ >= 0 && ::setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) == 0 &&
        ::bind(socket_, generic, sizeof address) == 0 && ::listen(socket_, backlog) == 0 &&
        ::getsockname(socket_, generic, &size) == 0) {
      port_ = ntohs(address.sin_port);
      return;
    }
    if (socket_ >= 0) ::close(socket_);
    throw ConfigError(
        "127.0.0.1:" + std::to_string(port) +
        " cannot be opened and may be in use: choose another port with --live PORT (0: any free port)");
  }
  ~Listener() { ::close(socket_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  int socket() const { return socket_; }
  int port() const { return port_; }

 private:
  int socket_;
  int port_ = 0;
};

/// Wakes the thread that polls.
class Bell {
 public:
  Bell() : descriptor_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (descriptor_ < 0)
      throw DeviceError(
          "the live page's server could not open its files: raise the limit on open files (ulimit -n)");
  }
  ~Bell() { ::close(descriptor_); }
  Bell(const Bell&) = delete;
  Bell& operator=(const Bell&) = delete;

  int descriptor() const { return descriptor_; }
  void ring() const noexcept { (void)!::eventfd_write(descriptor_, 1); }
  void silence() const noexcept {
    eventfd_t count = 0;
    (void)!::eventfd_read(descriptor_, &count);
  }

 private:
  int descriptor_;
};

}  // namespace

class LiveServer::Implementation {
 public:
  Implementation(LiveFeed& feed, int port, int cpu, std::function<void()> stop)
      : feed_(feed), stop_(std::move(stop)), token_(random_token()), listener_(port) {
    polled_.reserve(max_connections + 2);
    try {
      thread_ = std::thread([this, cpu] { serve(cpu); });
    } catch (const std::system_error&) {
      throw DeviceError("the live page's server could not start: raise the limit on threads (ulimit -u)");
    }
    feed_.wake_with([this] { bell_.ring(); });
  }

  ~Implementation() {
    closing_ = true;
    bell_.ring();
    thread_.join();
    feed_.wake_with({});
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  int port() const { return listener_.port(); }

 private:
  void serve(int cpu) {
    make_way(cpu);
    while (!closing_) {
      wait();
      const Time now = std::chrono::steady_clock::now();
      // Those who are here before those who come: a request that has arrived is answered before its
      // connection could give way to a new one.
      for (std::size_t i = 2; i < polled_.size(); ++i)
        serve_connection(*polled_connections_[i - 2], polled_[i].revents, now);
      if ((polled_[0].revents & POLLIN) != 0) bell_.silence();
      for (HttpConnection& connection : connections_) {
        connection.take_events(now);
        connection.end_when_overdue(now);
      }
      drop_closed();
      if ((polled_[1].revents & POLLIN) != 0) accept_some(now);
    }
  }

  void wait() {
    polled_.clear();
    polled_connections_.clear();
    polled_.push_back({bell_.descriptor(), POLLIN, 0});
    polled_.push_back({std::chrono::steady_clock::now() < deaf_until_ ? -1 : listener_.socket(), POLLIN, 0});
    for (HttpConnection& connection : connections_) {
      const int events = POLLIN | (connection.wants_to_write() ? POLLOUT : 0);
      polled_.push_back({connection.socket(), static_cast<short>(events), 0});
      polled_connections_.push_back(&connection);
    }
    constexpr auto pause_ms = std::chrono::milliseconds(longest_pause).count();
    if (::poll(polled_.data(), polled_.size(), static_cast<int>(pause_ms)) >= 0) return;
    for (pollfd& one : polled_) one.revents = 0;
  }

  void serve_connection(HttpConnection& connection, int revents, Time now) {
    if ((revents & POLLOUT) != 0) connection.send(now);
    if ((revents & (POLLIN | POLLHUP | POLLERR)) == 0) return;
    connection.receive(now);
    if (connection.state() != HttpConnection::State::reading) return;
    HttpRequest request;
    switch (read_head(connection.received(), request)) {
      case HeadReading::incomplete:
        return;
      case HeadReading::complete:
        return answer(connection, request, now);
      case HeadReading::too_large:
        return refuse(connection, HttpStatus::head_too_large, "send a shorter request", now);
      case HeadReading::malformed:
        return refuse(connection, HttpStatus::bad_request,
                      "this is not an HTTP request: open the page with a browser", now);
    }
  }

  void accept_some(Time now) {
    for (std::size_t i = 0; i < max_accepted_at_once; ++i) {
      const int socket = ::accept4(listener_.socket(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (socket < 0 && (errno == ECONNABORTED || errno == EINTR)) continue;
      if (socket < 0) {
        // Out of descriptors: not asked again at once, which would keep the processor busy.
        if (errno != EAGAIN) deaf_until_ = now + longest_pause;
        return;
      }
      const int yes = 1;
      ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
      if (connections_.size() == max_connections) make_room();
      // Its request may have arrived already.
      serve_connection(connections_.emplace_back(socket, now), POLLIN, now);
    }
  }

  /// The oldest of those that are no stream gives way: there are always such, streams are few.
  void make_room() {
    static_assert(max_streams < max_connections);
    connections_.erase(std::find_if(connections_.begin(), connections_.end(), [](const HttpConnection& one) {
      return one.state() != HttpConnection::State::streaming;
    }));
  }

  void drop_closed() {
    connections_.remove_if(
        [](const HttpConnection& one) { return one.state() == HttpConnection::State::closed; });
  }

  /// The name that a browser on this machine has for us; and the origin, where it says one.
  bool is_ours(const HttpRequest& request) const {
    const std::string host(request.value_of("Host"));
    const std::string number = std::string(":").append(std::to_string(port()));
    if (request.count_of("Host") != 1 || request.count_of("Origin") > 1) return false;
    if (host != "127.0.0.1" + number && host != "localhost" + number) return false;
    return request.count_of("Origin") == 0 || request.value_of("Origin") == "http://" + host;
  }

  std::string page() const {
    return replaced(replaced(std::string(page_text), "{{palette}}", color::css_variables()), "{{token}}",
                    token_);
  }

  void answer(HttpConnection& connection, const HttpRequest& request, Time now) {
    if (!is_ours(request))
      return refuse(connection, HttpStatus::forbidden,
                    "open http://127.0.0.1:" + std::to_string(port()) + "/ on this machine", now);
    if (request.method == "GET" && request.path == "/")
      return connection.answer(whole("text/html; charset=utf-8", page(), HttpStatus::ok), now);
    if (request.method == "GET" && request.path == "/events") return stream(connection, now);
    if (request.method == "POST" && request.path == "/stop") return press(connection, request, now);
    refuse(connection, HttpStatus::not_found, "not found: the page is at /", now);
  }

  void stream(HttpConnection& connection, Time now) {
    if (feed_.readers() >= max_streams)
      return refuse(connection, HttpStatus::too_many_pages,
                    "too many pages of this run are open: close one of them", now);
    connection.stream(head(HttpStatus::ok, "text/event-stream") + "\r\n", feed_, now);
  }

  void press(HttpConnection& connection, const HttpRequest& request, Time now) {
    if (request.value_of(token_header) != token_)
      return refuse(connection, HttpStatus::forbidden, "this page belongs to another run: reload it", now);
    stop_();
    connection.answer(whole("text/plain; charset=utf-8", "stopping\n", HttpStatus::ok), now);
  }

  void refuse(HttpConnection& connection, HttpStatus status, const std::string& sentence, Time now) const {
    connection.answer(whole("text/plain; charset=utf-8", sentence + "\n", status), now);
  }

  std::string whole(const std::string& type, const std::string& body, HttpStatus status) const {
    return head(status, type) + "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
  }

  /// Without the empty line at its end.
  std::string head(HttpStatus status, const std::string& type) const {
    return "HTTP/1.1 " + std::to_string(static_cast<int>(status)) + " " + words_for(status) +
           "\r\nContent-Type: " + type +
           "\r\nConnection: close\r\nCache-Control: no-store\r\nX-Frame-Options: DENY\r\n"
           "X-Content-Type-Options: nosniff\r\nCross-Origin-Resource-Policy: same-origin\r\n"
           "Content-Security-Policy: default-src 'none'; connect-src 'self'; img-src data:; style-src "
           "'nonce-" +
           token_ + "'; script-src 'nonce-" + token_ +
           "'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n";
  }

  LiveFeed& feed_;
  std::function<void()> stop_;
  std::string token_;
  Listener listener_;
  Bell bell_;
  std::list<HttpConnection> connections_;  ///< the oldest first
  std::vector<pollfd> polled_;             ///< bell, listener, connections
  std::vector<HttpConnection*> polled_connections_;
  Time deaf_until_{};  ///< no new connections before
  std::atomic<bool> closing_{false};
  std::thread thread_;
};

LiveServer::LiveServer(LiveFeed& feed, int port, int cpu, std::function<void()> stop)
    : implementation_(std::make_unique<Implementation>(feed, port, cpu, std::move(stop))) {}

LiveServer::~LiveServer() = default;

int LiveServer::port() const {
  return implementation_->port();
}

}  // namespace upright
