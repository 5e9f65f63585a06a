#include "live_server.hpp"

#include <httplib.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <random>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "upright/model/error.hpp"
#include "upright/runtime/realtime.hpp"

namespace upright {

namespace {

using namespace std::chrono_literals;

constexpr std::string_view page_text =
#include "live_page.inc"
    ;

/// Each open page takes a thread for its events; the others stay free for the stop button.
constexpr std::size_t most_streams = 6;
constexpr std::size_t threads = most_streams + 4;
constexpr auto event_patience = 500ms;
constexpr std::size_t longest_request = 1024;
constexpr const char* token_header = "X-Upright-Token";

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

void refuse(httplib::Response& response, int status, const std::string& sentence) {
  response.status = status;
  response.set_content(sentence + "\n", "text/plain; charset=utf-8");
}

}  // namespace

class LiveServer::Implementation {
 public:
  Implementation(LiveFeed& feed, int port, int cpu, std::function<void()> stop)
      : feed_(feed), stop_(std::move(stop)), token_(random_token()) {
    set_up();
    bind(port);
    route();
    listener_ = std::thread([this, cpu] { listen(cpu); });
    while (!server_.is_running() && !failed_) std::this_thread::sleep_for(1ms);
    if (!failed_) return;
    listener_.join();
    throw DeviceError("raise the limit on threads (ulimit -u): the live page's server could not start");
  }

  ~Implementation() {
    closing_ = true;
    server_.stop();
    listener_.join();
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  int port() const { return port_; }

 private:
  void set_up() {
    server_.new_task_queue = [] { return new httplib::ThreadPool(threads); };
    // One request per connection: a thread waits for no second one.
    server_.set_keep_alive_max_count(1);
    server_.set_read_timeout(2s);
    server_.set_write_timeout(2s);
    server_.set_payload_max_length(longest_request);
    server_.set_tcp_nodelay(true);
    // Not the library's own SO_REUSEPORT, with which two programs would share the port.
    server_.set_socket_options([](socket_t socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
  }

  void bind(int port) {
    const char* address = "127.0.0.1";
    if (port == 0)
      port_ = server_.bind_to_any_port(address);
    else if (server_.bind_to_port(address, port))
      port_ = port;
    if (port_ > 0) return;
    throw ConfigError("choose another port with --live=PORT (0: any free one): 127.0.0.1:" +
                      std::to_string(port) + " cannot be had, it may be in use");
  }

  /// The name that a browser on this machine has for us; and the origin, where it says one.
  bool is_ours(const httplib::Request& request) const {
    const std::string host = request.get_header_value("Host");
    const std::string number = std::string(":").append(std::to_string(port_));
    if (host != "127.0.0.1" + number && host != "localhost" + number) return false;
    return !request.has_header("Origin") || request.get_header_value("Origin") == "http://" + host;
  }

  void route() {
    using httplib::Request;
    using httplib::Response;
    server_.set_default_headers({{"Cache-Control", "no-store"},
                                 {"X-Frame-Options", "DENY"},
                                 {"X-Content-Type-Options", "nosniff"},
                                 {"Cross-Origin-Resource-Policy", "same-origin"},
                                 {"Content-Security-Policy",
                                  "default-src 'none'; connect-src 'self'; img-src data:; style-src "
                                  "'nonce-" +
                                      token_ + "'; script-src 'nonce-" + token_ +
                                      "'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"}});
    server_.set_pre_routing_handler([this](const Request& request, Response& response) {
      using Result = httplib::Server::HandlerResponse;
      if (is_ours(request)) return Result::Unhandled;
      refuse(response, 403, "open http://127.0.0.1:" + std::to_string(port_) + "/ on this machine");
      return Result::Handled;
    });
    server_.Get("/", [this](const Request&, Response& response) {
      response.set_content(replaced(std::string(page_text), "{{token}}", token_), "text/html; charset=utf-8");
    });
    server_.Get("/events", [this](const Request&, Response& response) { stream(response); });
    server_.Post("/stop", [this](const Request& request, Response& response) {
      if (request.get_header_value(token_header) != token_)
        return refuse(response, 403, "reload the page: this button is of another run");
      stop_();
      response.set_content("stopping\n", "text/plain; charset=utf-8");
    });
  }

  void stream(httplib::Response& response) {
    if (feed_.readers() >= most_streams)
      return refuse(response, 503, "close another page of this run: too many are open");
    const auto reader = std::make_shared<LiveFeed::Reader>(feed_);
    response.set_chunked_content_provider("text/event-stream",
                                          [this, reader](std::size_t, httplib::DataSink& sink) {
                                            if (closing_) return false;
                                            std::string events = reader->next(event_patience);
                                            // A comment shows whether somebody still listens.
                                            if (events.empty()) events = ":\n\n";
                                            if (!sink.write(events.data(), events.size())) return false;
                                            if (reader->over()) sink.done();
                                            return true;
                                          });
  }

  void listen(int cpu) {
    make_way(cpu);
    try {
      if (server_.listen_after_bind()) return;
    } catch (const std::system_error&) {
      // No more threads: said by the one who waits for us.
    }
    failed_ = !closing_;
  }

  LiveFeed& feed_;
  std::function<void()> stop_;
  std::string token_;
  httplib::Server server_;
  int port_ = 0;
  std::atomic<bool> closing_{false}, failed_{false};
  std::thread listener_;
};

LiveServer::LiveServer(LiveFeed& feed, int port, int cpu, std::function<void()> stop)
    : implementation_(std::make_unique<Implementation>(feed, port, cpu, std::move(stop))) {}

LiveServer::~LiveServer() = default;

int LiveServer::port() const {
  return implementation_->port();
}

}  // namespace upright
