// The live page's HTTP server, on the loopback interface only. It answers three requests: the page, its
// stream of events, and the stop button. Another web page in the same browser can do none of them: requests
// that name another host (a name turned to this address) or come from another origin are refused, and the
// stop button needs the token that only the page itself holds.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "live_feed.hpp"

namespace upright {

class LiveServer {
 public:
  /// `port` 0: any free one. `cpu`: the processor to stay off, -1: none. `stop` is called by a thread of the
  /// server. Throws ConfigError when the port cannot be had.
  LiveServer(LiveFeed& feed, int port, int cpu, std::function<void()> stop);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  int port() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace upright
