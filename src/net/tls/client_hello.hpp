// The plain content of a TLS client's first message: the server that it names, the protocols that
// it offers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/bytes.hpp"

namespace connect_bridge {

// The result of reading the first bytes of a connection (RFC 8446 section 4.1.2). Of what is
// hostile nothing is believed: each length is checked against what is there.
struct ClientHello {
  enum class State : std::uint8_t { kMore, kComplete, kWrong };
  static constexpr std::size_t kBytesMax = 16384;  // with the heads of its records

  State state = State::kMore;
  std::size_t missing = 0;  // kMore: at least so many more bytes belong to it
  // kComplete.
  std::string server_name{};             // in lower case; empty: none
  std::vector<std::string> protocols{};  // of ALPN, in their order
};

// Without any bytes it returns how many to read first; who reads no more than that reads no byte
// beyond the ClientHello. It is wrong as soon as that is known.
[[nodiscard]] ClientHello read_client_hello(ByteView bytes);

}  // namespace connect_bridge
