#include "stream.hpp"

#include <cstdio>

#include "upright/base/error.hpp"

namespace upright::cli {

void add_stream(const Command& command, std::string& address) {
  command.option("--stream", address,
                 "Send each row as a UDP datagram with JSON, as PlotJuggler's UDP server reads it: "
                 "udp://127.0.0.1:9870");
}

std::unique_ptr<UdpStream> open_stream(const std::string& address, bool fast) {
  if (address.empty()) return nullptr;
  if (fast) throw ConfigError("--stream needs real time and --fast is virtual time: remove one of them");
  return std::make_unique<UdpStream>(address);
}

void print_stream(const UdpStream* stream) {
  if (!stream) return;
  std::printf("Stream: %llu rows sent to %s, %llu dropped.\n",
              static_cast<unsigned long long>(stream->sent()), stream->address().c_str(),
              static_cast<unsigned long long>(stream->dropped()));
}

void add_stream(nlohmann::ordered_json& document, const UdpStream* stream) {
  if (stream)
    document["stream"] = {
        {"address", stream->address()}, {"rows_sent", stream->sent()}, {"rows_dropped", stream->dropped()}};
}

}  // namespace upright::cli
