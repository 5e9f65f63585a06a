// What commands with --stream share: the flag, the stream, and what is said of it.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "command_line.hpp"
#include "live/udp_stream.hpp"

namespace upright::cli {

/// Adds --stream; `address` stays empty where it is not given.
void add_stream(const Command& command, std::string& address);

/// Where the rows are sent; null where it was not asked for. Throws ConfigError with --fast.
std::unique_ptr<UdpStream> open_stream(const std::string& address, bool fast);

/// How many rows were sent, for people and in JSON; nothing without a stream.
void print_stream(const UdpStream* stream);
void add_stream(nlohmann::ordered_json& document, const UdpStream* stream);

}  // namespace upright::cli
