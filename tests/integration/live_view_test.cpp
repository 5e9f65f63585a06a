// The live page's server over loopback: what it serves, whom it refuses, what its stop button does, and that
// nobody who reads slowly or not at all holds up the one who writes.
#include "live/live_view.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/real_time.hpp"
#include "upright/base/error.hpp"

namespace upright {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

LogRecord row(std::uint64_t tick) {
  LogRecord r;
  r.tick = tick;
  r.time_ns = static_cast<std::int64_t>(tick) * 1'000'000;
  r.cart_m = 1e-4 * static_cast<double>(tick);
  return r;
}

/// A server, on a port of its own.
class Served {
 public:
  Served() {
    LiveScene scene;
    scene.title = "a test";
    view_ = std::make_unique<LiveView>(scene, LiveOptions{0, -1, [this] { ++stops_; }});
    const std::string url = view_->url();
    port_ = std::stoi(url.substr(url.rfind(':') + 1));
  }

  httplib::Client client() const {
    httplib::Client client("127.0.0.1", port_);
    client.set_read_timeout(5s);
    return client;
  }
  std::string page() { return client().Get("/")->body; }
  std::string token() {
    const std::string text = page();
    std::smatch found;
    return std::regex_search(text, found, std::regex("'X-Upright-Token': '([0-9a-f]{32})'")) ? found[1].str()
                                                                                             : "";
  }
  int status_of_stop(const httplib::Headers& headers) {
    const auto answer = client().Post("/stop", headers, "", "text/plain");
    return answer ? answer->status : -1;
  }
  /// Reads the stream until `enough` says so; what arrived.
  template <class Enough>
  std::string stream(Enough&& enough) {
    std::string text;
    client().Get("/events", [&](const char* data, std::size_t size) {
      text.append(data, size);
      return !enough(text);
    });
    return text;
  }
  void write_rows(std::uint64_t first, std::uint64_t count) {
    std::vector<LogRecord> rows;
    rows.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) rows.push_back(row(first + i));
    view_->see(rows);
  }
  static std::size_t count_of(const std::string& text, const std::string& what) {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += what.size()) ++count;
    return count;
  }

  std::atomic<int> stops_{0};
  std::unique_ptr<LiveView> view_;
  int port_ = 0;
};

class LiveServed : public ::testing::Test, public Served {};

TEST_F(LiveServed, ThePageIsWholeAndAsksForNothingElsewhere) {
  const auto answer = client().Get("/");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
  const std::string text = answer->body;
  EXPECT_EQ(text.find("{{"), std::string::npos);
  EXPECT_NE(text.find("</html>"), std::string::npos);
  // The only address in it is the name of the SVG namespace, which nobody fetches.
  EXPECT_EQ(count_of(text, "//www.w3.org/2000/svg"), 1u);
  EXPECT_EQ(count_of(text, "http:") + count_of(text, "https:"), 1u);
  EXPECT_EQ(std::regex_search(text, std::regex("(src|href)=\"(?!data:)")), false);
  EXPECT_NE(answer->get_header_value("Content-Security-Policy").find("default-src 'none'"),
            std::string::npos);
  EXPECT_FALSE(answer->has_header("Access-Control-Allow-Origin"));
}

void read_stream() {
  Served served;
  served.view_->say({LiveState::Kind::running, "balancing"});
  const test::Since written;
  served.write_rows(0, 1000);
  std::this_thread::sleep_for(200ms);
  const test::Interval taking = written.until_now();
  std::atomic<bool> more{false};
  std::thread writer([&] {
    while (!more) std::this_thread::sleep_for(5ms);
    served.write_rows(1000, 500);
  });
  const std::string text = served.stream([&](const std::string& so_far) {
    more = true;
    return so_far.find("\"rows\":1500") != std::string::npos && so_far.ends_with("\n\n");
  });
  more = true;
  writer.join();
  ASSERT_EQ(text.find("event: scene\ndata: {\"title\":\"a test\""), 0u) << text.substr(0, 200);
  const std::size_t history = text.find("event: frame\ndata: ");
  ASSERT_NE(history, std::string::npos);
  const std::size_t begin = history + std::string("event: frame\ndata: ").size();
  const Json first = Json::parse(text.substr(begin, text.find('\n', begin) - begin));
  EXPECT_TIMING(taking, first.at("rows") == 1000, "the rows are taken in time");
  EXPECT_EQ(first.at("points").size(), 200u);
  EXPECT_EQ(first.at("state").at("text"), "balancing");
  EXPECT_EQ(first.at("unseen"), 0);
}

TEST(LiveStream, BeginsWithSceneAndHistoryAndGoesOn) {
  test::in_real_time(read_stream);
}

void end_pages() {
  Served served;
  std::vector<std::thread> pages;
  std::vector<std::string> texts(3);
  for (std::string& text : texts)
    pages.emplace_back([&] { text = served.stream([](const std::string&) { return false; }); });
  std::this_thread::sleep_for(300ms);
  const test::Since begin;
  served.view_->end({LiveState::Kind::stopped, "it was enough"});
  const test::Interval ending = begin.until_now();
  for (std::thread& page : pages) page.join();
  EXPECT_TIMING(ending, ending.end_s - ending.begin_s < 0.9, "no page is waited for");
  for (const std::string& text : texts) {
    EXPECT_EQ(Served::count_of(text, "event: end\n"), 1u);
    EXPECT_NE(text.find("it was enough"), std::string::npos);
  }
}

TEST(LiveStream, EndReachesEveryOpenPageAndClosesIt) {
  test::in_real_time(end_pages);
}

TEST_F(LiveServed, TheStopButtonNeedsThePagesToken) {
  EXPECT_EQ(status_of_stop({}), 403);
  EXPECT_EQ(status_of_stop({{"X-Upright-Token", std::string(32, '0')}}), 403);
  const auto read = client().Get("/stop");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->status, 404);
  EXPECT_EQ(stops_, 0);
  EXPECT_EQ(status_of_stop({{"X-Upright-Token", token()}}), 200);
  EXPECT_EQ(stops_, 1);
}

TEST_F(LiveServed, AForeignHostOrOriginIsRefusedEvenWithTheToken) {
  const std::string good = token();
  const std::string port = std::string(":").append(std::to_string(port_));
  ASSERT_EQ(good.size(), 32u);
  const std::vector<httplib::Headers> foreign = {
      {{"Host", "evil.example" + port}},
      {{"Host", "127.0.0.1"}},
      {{"Host", "127.0.0.1.evil.example" + port}},
      {{"Origin", "http://evil.example"}},
      {{"Origin", "null"}},
      {{"Origin", "http://localhost" + port}},  // a name for us, but not the one that was asked
      {{"Origin", "https://127.0.0.1" + port}},
  };
  for (httplib::Headers headers : foreign) {
    const std::string who = headers.begin()->first + ": " + headers.begin()->second;
    for (const char* path : {"/", "/events"}) {
      const auto answer = client().Get(path, headers);
      ASSERT_TRUE(answer) << who;
      EXPECT_EQ(answer->status, 403) << who << " " << path;
      EXPECT_EQ(answer->body.find(good), std::string::npos) << who;
    }
    headers.emplace("X-Upright-Token", good);
    EXPECT_EQ(status_of_stop(headers), 403) << who;
  }
  EXPECT_EQ(stops_, 0);
  EXPECT_EQ(
      status_of_stop(
          {{"Host", "localhost" + port}, {"Origin", "http://localhost" + port}, {"X-Upright-Token", good}}),
      200);
}

/// Whether something answers at an address of this machine.
bool answers(const in_addr& address, int port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  to.sin_addr = address;
  const bool connected = ::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  ::close(fd);
  return connected;
}

TEST_F(LiveServed, OnlyTheLoopbackAddressAnswers) {
  ifaddrs* all = nullptr;
  ASSERT_EQ(getifaddrs(&all), 0);
  int asked = 0;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    const in_addr address = reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr;
    const bool loopback = address.s_addr == htonl(INADDR_LOOPBACK);
    EXPECT_EQ(answers(address, port_), loopback) << inet_ntoa(address);
    ++asked;
  }
  freeifaddrs(all);
  EXPECT_GT(asked, 0);
  in_addr second{};
  second.s_addr = htonl(INADDR_LOOPBACK + 1);  // 127.0.0.2: bound to everything, it would answer
  EXPECT_FALSE(answers(second, port_));
}

TEST_F(LiveServed, APortInUseIsRefusedWithTheRemedy) {
  try {
    const LiveView second(LiveScene{}, LiveOptions{port_, -1, [] {}});
    FAIL() << "two programs share a port";
  } catch (const ConfigError& refused) {
    EXPECT_NE(std::string(refused.what()).find("--live PORT"), std::string::npos) << refused.what();
  }
}

// As many open streams as are allowed and more, none of which is read.
std::vector<int> open_unread_streams(int port) {
  std::vector<int> idle;
  for (int i = 0; i < 8; ++i) {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int small = 4096;
    setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    const std::string request =
        "GET /events HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n\r\n";
    EXPECT_EQ(::write(fd, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    idle.push_back(fd);
  }
  return idle;
}

void write_beside_unread_streams() {
  Served served;
  const std::string good = served.token();
  const std::vector<int> idle = open_unread_streams(served.port_);
  test::Interval longest;
  for (std::uint64_t tick = 0; tick < 1000; tick += 20) {
    const test::Since begin;
    served.write_rows(tick, 20);
    const test::Interval took = begin.until_now();
    if (took.end_s - took.begin_s > longest.end_s - longest.begin_s) longest = took;
    std::this_thread::sleep_for(20ms);
  }
  EXPECT_EQ(served.status_of_stop({{"X-Upright-Token", good}}), 200);
  for (const int fd : idle) ::close(fd);
  // A lock held while a page is written to would show as the server's write timeout, two seconds.
  EXPECT_TIMING(longest, longest.end_s - longest.begin_s < 0.5, "the log is not held up");
}

TEST(LiveStream, UnreadHoldsUpNeitherTheLogNorTheStopButton) {
  test::in_real_time(write_beside_unread_streams);
}

}  // namespace
}  // namespace upright
