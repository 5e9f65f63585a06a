#include "http_connection.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

namespace upright {

namespace {

using namespace std::chrono_literals;

/// From the connection to the end of its request, however slowly that comes.
constexpr auto request_patience = 2s;
/// For somebody who takes none of the bytes that wait for him.
constexpr auto write_patience = 2s;
constexpr auto linger_patience = 500ms;
constexpr auto comment_pause = 500ms;

bool would_wait() {
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

}  // namespace

HttpConnection::HttpConnection(int socket, Time now) : socket_(socket), accepted_(now), moved_(now) {}

HttpConnection::~HttpConnection() {
  ::close(socket_);
}

void HttpConnection::receive(Time now) {
  std::array<char, 4096> part;
  const std::size_t room = state_ == State::reading ? longest_head_bytes - in_.size() : part.size();
  const ssize_t count = ::recv(socket_, part.data(), std::min(room, part.size()), 0);
  if (count < 0 && would_wait()) return;
  if (count <= 0) return close();
  if (state_ == State::reading) in_.append(part.data(), static_cast<std::size_t>(count));
  if (state_ == State::reading) moved_ = now;
}

void HttpConnection::send(Time now) {
  if (wants_to_write()) {
    const ssize_t count = ::send(socket_, out_.data() + sent_, out_.size() - sent_, MSG_NOSIGNAL);
    if (count < 0 && would_wait()) return;
    if (count < 0) return close();
    sent_ += static_cast<std::size_t>(count);
    moved_ = now;
  }
  if (wants_to_write()) return;
  out_.clear();
  sent_ = 0;
  if (state_ == State::streaming && reader_->over()) state_ = State::answering;
  if (state_ != State::answering) return;
  // Closing with bytes unread would take the answer away from the one who reads it.
  ::shutdown(socket_, SHUT_WR);
  reader_.reset();
  state_ = State::lingering;
}

void HttpConnection::put(std::string text, Time now) {
  out_ = std::move(text);
  sent_ = 0;
  moved_ = now;
  in_ = {};
}

void HttpConnection::answer(std::string text, Time now) {
  put(std::move(text), now);
  state_ = State::answering;
  send(now);
}

void HttpConnection::stream(std::string head, LiveFeed& feed, Time now) {
  reader_ = std::make_unique<LiveFeed::Reader>(feed);
  put(std::move(head), now);
  state_ = State::streaming;
  send(now);
}

void HttpConnection::take_events(Time now) {
  if (state_ != State::streaming || wants_to_write()) return;
  std::string events = reader_->next();
  if (events.empty() && now - moved_ > comment_pause) events = ":\n\n";
  if (events.empty() && !reader_->over()) return;
  out_ = std::move(events);
  moved_ = now;
  send(now);
}

void HttpConnection::end_when_overdue(Time now) {
  const bool overdue = state_ == State::reading     ? now - accepted_ > request_patience
                       : state_ == State::lingering ? now - moved_ > linger_patience
                                                    : wants_to_write() && now - moved_ > write_patience;
  if (overdue) close();
}

void HttpConnection::close() {
  reader_.reset();
  state_ = State::closed;
}

}  // namespace upright
