// One connection of the live page's server: what it has sent of its request, and what it still has to be
// sent. Nothing here waits.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "http_request.hpp"
#include "live_feed.hpp"

namespace upright {

class HttpConnection {
 public:
  using Time = std::chrono::steady_clock::time_point;

  enum class State {
    reading,    ///< its request is not whole
    streaming,  ///< the page's events
    answering,  ///< the last bytes are on their way
    lingering,  ///< everything is sent; what still comes in is thrown away, so that the answer arrives
    closed,
  };

  /// Owns the socket, which does not block.
  HttpConnection(int socket, Time now);
  ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  int socket() const { return socket_; }
  State state() const { return state_; }
  bool wants_to_write() const { return sent_ < out_.size(); }
  Time accepted() const { return accepted_; }

  /// Takes what has come. Of a request at most `longest_head_bytes` are kept.
  void receive(Time now);
  /// What has come of the request.
  std::string_view received() const { return in_; }
  /// Sends what can be sent now.
  void send(Time now);

  /// The whole answer: sent, then the connection ends.
  void answer(std::string text, Time now);
  /// Begins a stream: `head`, then the feed's events until it is over.
  void stream(std::string head, LiveFeed& feed, Time now);
  /// Takes the feed's next events, once the last ones are sent. A comment where nothing came for a while
  /// shows whether somebody still listens.
  void take_events(Time now);

  /// Ends it when it has taken too long over its request, over what it was sent, or over its end.
  void end_when_overdue(Time now);
  void close();

 private:
  void put(std::string text, Time now);

  int socket_;
  State state_ = State::reading;
  Time accepted_;
  Time moved_;  ///< when it last took bytes, or had none to take
  std::string in_, out_;
  std::size_t sent_ = 0;
  std::unique_ptr<LiveFeed::Reader> reader_;
};

}  // namespace upright
