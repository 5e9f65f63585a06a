// The live page's server under clients that mean harm or fail: requests without end take no memory, and
// neither many connections nor slow ones keep the stop button from being heard.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <fstream>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "live/live_view.hpp"
#include "tests/support/real_time.hpp"

namespace upright {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

/// A socket that is connected to a port of this machine.
class Caller {
 public:
  explicit Caller(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  }
  ~Caller() { ::close(socket_); }
  Caller(const Caller&) = delete;
  Caller& operator=(const Caller&) = delete;

  /// False once the other side has ended it.
  bool send(const std::string& text) const {
    return connected_ && ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL) > 0;
  }
  /// What comes until the other side ends it, or `patience` is over.
  std::string receive(std::chrono::milliseconds patience) const {
    std::string text;
    const auto until = steady_clock::now() + patience;
    for (;;) {
      pollfd one{socket_, POLLIN, 0};
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - steady_clock::now());
      if (left.count() <= 0 || ::poll(&one, 1, static_cast<int>(left.count())) <= 0) return text;
      char part[4096];
      const ssize_t count = ::recv(socket_, part, sizeof part, 0);
      if (count <= 0) return text;
      text.append(part, static_cast<std::size_t>(count));
    }
  }

 private:
  int socket_;
  bool connected_ = false;
};

double resident_mib() {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("VmRSS:")) return std::stod(line.substr(6)) / 1024.0;
  return 0.0;
}

/// A server, on a port of its own, and its stop button's token.
class Served {
 public:
  Served() : view_(LiveScene{}, LiveOptions{0, -1, [this] { ++stops_; }}) {
    const std::string url = view_.url();
    port_ = std::stoi(url.substr(url.rfind(':') + 1));
    const std::string page = ask("GET / HTTP/1.1", "", 5s);
    std::smatch found;
    if (std::regex_search(page, found, std::regex("'X-Upright-Token': '([0-9a-f]{32})'"))) token_ = found[1];
  }

  std::string ask(const std::string& line, const std::string& fields, std::chrono::milliseconds patience) {
    const Caller caller(port_);
    caller.send(line + "\r\nHost: 127.0.0.1:" + std::to_string(port_) + "\r\n" + fields + "\r\n");
    return caller.receive(patience);
  }

  /// The stop button answers, within a second.
  void expect_stop() {
    const test::Since begin;
    const std::string answer =
        ask("POST /stop HTTP/1.1", "X-Upright-Token: " + token_ + "\r\nContent-Length: 0\r\n", 10s);
    const test::Interval took = begin.until_now();
    EXPECT_TRUE(answer.starts_with("HTTP/1.1 200")) << answer;
    EXPECT_TIMING(took, took.end_s - took.begin_s < 1.0, "the stop button answers in time");
  }

  /// Sends `begin`, then `more` again and again, up to 64 MiB over several connections; how much arrived.
  double send_without_end(const std::string& begin, const std::string& more) {
    constexpr int connections = 8;
    constexpr double mib_each = 8.0;
    std::atomic<std::size_t> sent{0};
    std::vector<std::thread> senders;
    for (int i = 0; i < connections; ++i)
      senders.emplace_back([&] {
        const Caller caller(port_);
        caller.send(begin);
        std::size_t mine = 0;
        while (static_cast<double>(mine) < mib_each * 1048576.0 && caller.send(more)) mine += more.size();
        sent += mine;
      });
    for (std::thread& sender : senders) sender.join();
    return static_cast<double>(sent) / 1048576.0;
  }

  std::atomic<int> stops_{0};
  LiveView view_;
  int port_ = 0;
  std::string token_;
};

class LiveServerLimits : public ::testing::Test, public Served {};

TEST_F(LiveServerLimits, RequestsWithoutEndTakeNoMemory) {
  const std::string host = "\r\nHost: 127.0.0.1:" + std::to_string(port_) + "\r\n";
  std::string fields;
  for (int i = 0; i < 400; ++i)
    fields += "X-Number-" + std::to_string(i) + ": " + std::string(20, 'x') + "\r\n";
  const std::string stop = "POST /stop HTTP/1.1" + host;
  const struct {
    const char* what;
    std::string begin, more;
  } cases[] = {
      {"one line", "GET / HTTP/1.1" + host + "X-Long: ", std::string(16384, 'x')},
      {"the first line", "GET /", std::string(16384, 'a')},
      {"many fields", "GET / HTTP/1.1" + host, fields},
      {"a body", stop + "Content-Length: 1000000000\r\n\r\n", std::string(16384, 'x')},
      {"a body in chunks", stop + "Transfer-Encoding: chunked\r\n\r\n",
       "4000\r\n" + std::string(0x4000, 'x') + "\r\n"},
  };
  for (const auto& one : cases) {
    const double before_mib = resident_mib();
    double max_mib = before_mib;
    std::atomic<bool> over{false};
    std::thread watcher([&] {
      for (; !over; std::this_thread::sleep_for(2ms)) max_mib = std::max(max_mib, resident_mib());
    });
    const double sent_mib = send_without_end(one.begin, one.more);
    over = true;
    watcher.join();
    EXPECT_LT(max_mib - before_mib, 4.0) << one.what << ": " << sent_mib << " MiB were sent";
  }
  expect_stop();
}

TEST_F(LiveServerLimits, RequestsBeyondEachLimitAreRefused) {
  EXPECT_TRUE(
      ask("GET / HTTP/1.1", "X-Long: " + std::string(4090, 'x') + "\r\n", 5s).starts_with("HTTP/1.1 431"));
  std::string fields;
  for (int i = 0; i < 64; ++i) fields += "X: y\r\n";
  EXPECT_TRUE(ask("GET / HTTP/1.1", fields, 5s).starts_with("HTTP/1.1 431"));
  EXPECT_TRUE(ask("GET / HTTP/1.1", fields.substr(6), 5s).starts_with("HTTP/1.1 200"));
  EXPECT_TRUE(ask("GET /", "", 5s).starts_with("HTTP/1.1 400"));
  EXPECT_TRUE(ask("GET / HTTP/1.1", "no colon\r\n", 5s).starts_with("HTTP/1.1 400"));
  EXPECT_TRUE(ask("GET / HTTP/1.1", "Host: evil.example\r\n", 5s).starts_with("HTTP/1.1 403"));
  EXPECT_TRUE(ask("DELETE / HTTP/1.1", "", 5s).starts_with("HTTP/1.1 404"));
}

TEST(LiveServer, StopButtonAnswersBesideIdleConnections) {
  test::in_real_time([] {
    Served served;
    std::vector<std::unique_ptr<Caller>> idle;
    for (int i = 0; i < 300; ++i) idle.push_back(std::make_unique<Caller>(served.port_));
    for (int i = 0; i < 5; ++i) served.expect_stop();
    EXPECT_EQ(served.stops_, 5);
  });
}

/// Threads that send byte after byte of a request, and come again when they are sent away.
class SlowSenders {
 public:
  explicit SlowSenders(int port) {
    for (int thread = 0; thread < 3; ++thread) threads_.emplace_back([this, port] { send(port); });
  }
  ~SlowSenders() {
    over_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  SlowSenders(const SlowSenders&) = delete;
  SlowSenders& operator=(const SlowSenders&) = delete;

 private:
  void send(int port) {
    std::vector<std::unique_ptr<Caller>> slow(100);
    for (std::size_t byte = 0; !over_; ++byte) {
      for (std::unique_ptr<Caller>& caller : slow)
        if (!caller || !caller->send(byte % 2 == 0 ? "G" : "E")) caller = std::make_unique<Caller>(port);
      std::this_thread::sleep_for(20ms);
    }
  }

  std::atomic<bool> over_{false};
  std::vector<std::thread> threads_;
};

TEST(LiveServer, StopButtonAnswersBesideSlowSenders) {
  test::in_real_time([] {
    Served served;
    const SlowSenders slow(served.port_);
    std::this_thread::sleep_for(300ms);
    for (int i = 0; i < 5; ++i) served.expect_stop();
    EXPECT_EQ(served.stops_, 5);
  });
}

}  // namespace
}  // namespace upright
