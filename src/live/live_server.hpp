// The live page's HTTP server, on the loopback interface only. It answers three requests: the page, its
// stream of events, and the stop button. Another web page in the same browser can do none of them: requests
// that name another host (a name turned to this address) or come from another origin are refused, and the
// stop button needs the token that only the page itself holds.
//
// One thread waits for all connections together, and each has fixed limits on what it may send and how long
// it may take. Connections beyond `max_connections` take the place of the one that has waited longest with
// its request, so that nobody who opens many of them, or sends slowly, keeps the stop button from being
// heard.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "live_feed.hpp"

namespace upright {

class LiveServer {
 public:
  /// `port` 0: any free one. `cpu`: the processor to stay off, -1: none. `stop` is called by the
  /// server's thread. Throws ConfigError when the port cannot be had, DeviceError when there is no thread.
  LiveServer(LiveFeed& feed, int port, int cpu, std::function<void()> stop);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  int port() const;

  static constexpr std::size_t max_connections = 64;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace upright
