// The three fixed binary records that precede everything else. docs/protocol.md section "Login".
// client -> server: hello, login (both at once); server -> client: welcome. Nothing else is legal
// before.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/result.hpp"

namespace connect_bridge {

inline constexpr char kSubprotocol[] = "ros2-connect.v1";
inline constexpr std::uint16_t kProtocolVersion = 1;
inline constexpr std::size_t kLoginRecordBytesMax = 4096;
inline constexpr std::size_t kNodeBytesMax = 255;
inline constexpr std::size_t kMethodBytesMax = 32;
inline constexpr std::size_t kCredentialBytesMax = 3900;
inline constexpr std::size_t kIdentityBytesMax = 1024;
inline constexpr std::uint32_t kDeadAfterMsMin = 100;
inline constexpr std::uint32_t kDeadAfterMsMax = 600'000;

struct Hello {
  std::uint16_t version_min = kProtocolVersion;
  std::uint16_t version_max = kProtocolVersion;
  Token128 side;     // random id of the client's process, never zero
  Token128 session;  // secret of a session to continue; zero: a new one
  std::string node;  // fully qualified node name, for people; at most 255 bytes of UTF-8
};

struct Login {
  std::string method;  // "none", "token", ...; 1 to 32 bytes of [a-z0-9_]
  Bytes credential;    // at most 3,900 bytes
};

struct Welcome {
  std::uint16_t version = kProtocolVersion;
  Token128 side;     // random id of the server's process, never zero
  Token128 session;  // secret of the session, to be presented in the next hello; not zero
  std::uint32_t dead_after_ms = 0;      // kDeadAfterMsMin to ...Max; 0: not given
  std::uint32_t message_bytes_max = 0;  // largest message the server accepts; 0: not given
  std::string node;                     // the server's node name
  std::string identity;                 // the identity that the server gave the client
};

// 1 to 32 bytes of [a-z0-9_].
[[nodiscard]] bool is_method(std::string_view method);

// Node names and identities are for people: invalid characters are replaced, and long ones are cut.
// A credential that is too long makes a record that the server refuses with kTooLarge.
Bytes encode(const Hello& record);
Bytes encode(const Login& record);
Bytes encode(const Welcome& record);

// Each function accepts exactly one whole record of at most kLoginRecordBytesMax bytes. Errors:
// kMalformed, kTooLarge, and kVersion for a hello of another protocol generation.
Result<Hello> decode_hello(ByteView record);
Result<Login> decode_login(ByteView record);
Result<Welcome> decode_welcome(ByteView record);

}  // namespace connect_bridge
