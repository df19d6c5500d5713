#include "core/wire/login.hpp"

#include <algorithm>
#include <limits>
#include <string_view>
#include <utility>

#include "core/base/byte_order.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge {
namespace {

// docs/protocol.md section "Login".
constexpr std::string_view kHelloMagic = "R2CH";
constexpr std::string_view kLoginMagic = "R2CL";
constexpr std::string_view kWelcomeMagic = "R2CW";
constexpr std::size_t kMagicBytes = 4;
constexpr std::size_t kVersionsEnd = 8;    // magic and versions: the same in every generation
constexpr std::size_t kHelloBytes = 42;    // without the node name
constexpr std::size_t kLoginBytes = 8;     // without method and credential
constexpr std::size_t kWelcomeBytes = 52;  // without node name and identity

std::string_view text_in(ByteView bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

bool has_magic(ByteView record, std::string_view magic) {
  return record.size() >= kMagicBytes && text_in(record.first(kMagicBytes)) == magic;
}

Token128 get_token(ByteView record, std::size_t offset) {
  Token128 token;
  const ByteView bytes = record.subspan(offset, token.bytes.size());
  std::copy(bytes.begin(), bytes.end(), token.bytes.begin());
  return token;
}

void put(std::string_view text, Bytes& out) {
  out.insert(out.end(), text.begin(), text.end());
}
void put(const Token128& token, Bytes& out) {
  out.insert(out.end(), token.bytes.begin(), token.bytes.end());
}

// A size that does not fit becomes the maximum: the peer then refuses the record as too large.
void put_size(std::size_t size, Bytes& out) {
  constexpr std::size_t kMost = std::numeric_limits<std::uint16_t>::max();
  put_le(static_cast<std::uint16_t>(std::min(size, kMost)), out);
}

// The checks that every record starts with.
Result<Nothing> check(ByteView record, std::string_view magic, std::size_t fixed_bytes) {
  if (record.size() > kLoginRecordBytesMax) {
    return Error{CloseCode::kTooLarge, "a login record is larger than 4096 bytes"};
  }
  if (!has_magic(record, magic)) {
    return Error{CloseCode::kMalformed, "a record does not begin with " + std::string{magic}};
  }
  if (record.size() < fixed_bytes) return malformed("a login record ends too early");
  return Nothing{};
}

}  // namespace

bool is_method(std::string_view method) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !method.empty() && method.size() <= kMethodBytesMax &&
         std::all_of(method.begin(), method.end(), allowed);
}

Bytes encode(const Hello& record) {
  const std::string node = to_text(record.node, kNodeBytesMax);
  Bytes out;
  out.reserve(kHelloBytes + node.size());
  put(kHelloMagic, out);
  put_le(record.version_min, out);
  put_le(record.version_max, out);
  put(record.side, out);
  put(record.session, out);
  put_size(node.size(), out);
  put(node, out);
  return out;
}

Bytes encode(const Login& record) {
  Bytes out;
  out.reserve(kLoginBytes + record.method.size() + record.credential.size());
  put(kLoginMagic, out);
  put_size(record.method.size(), out);
  put_size(record.credential.size(), out);
  put(record.method, out);
  out.insert(out.end(), record.credential.begin(), record.credential.end());
  return out;
}

Bytes encode(const Welcome& record) {
  const std::string node = to_text(record.node, kNodeBytesMax);
  const std::string identity = to_text(record.identity, kIdentityBytesMax);
  Bytes out;
  out.reserve(kWelcomeBytes + node.size() + identity.size());
  put(kWelcomeMagic, out);
  put_le(record.version, out);
  put_le(std::uint16_t{0}, out);
  // 0 has its own meaning on the wire ("not given"); other values are brought into the range.
  const std::uint32_t dead_after_ms =
      std::clamp(record.dead_after_ms, kDeadAfterMsMin, kDeadAfterMsMax);
  put_le(record.dead_after_ms == 0 ? 0 : dead_after_ms, out);
  put_le(record.message_bytes_max, out);
  put(record.side, out);
  put(record.session, out);
  put_size(node.size(), out);
  put_size(identity.size(), out);
  put(node, out);
  put(identity, out);
  return out;
}

Result<Hello> decode_hello(ByteView record) {
  // Checked only up to the versions: the rest has another length in another version.
  if (auto checked = check(record, kHelloMagic, kVersionsEnd); !checked) return checked.error();
  Hello hello;
  hello.version_min = get_le<std::uint16_t>(record, 4);
  hello.version_max = get_le<std::uint16_t>(record, 6);
  if (hello.version_min == 0 || hello.version_min > hello.version_max) {
    return malformed("a hello's versions are not a range");
  }
  // Another protocol generation may have another layout, so nothing after the versions is read.
  if (hello.version_min > kProtocolVersion || hello.version_max < kProtocolVersion) {
    return Error{CloseCode::kVersion,
                 "the client speaks protocol versions " + std::to_string(hello.version_min) +
                     " to " + std::to_string(hello.version_max) + ", this server speaks " +
                     std::to_string(kProtocolVersion)};
  }
  if (record.size() < kHelloBytes) return malformed("a hello ends too early");
  hello.side = get_token(record, 8);
  hello.session = get_token(record, 24);
  const auto node_bytes = get_le<std::uint16_t>(record, 40);
  // The length must match exactly: a record is a whole message, and nothing may hide behind it.
  if (record.size() != kHelloBytes + node_bytes) return malformed("a hello has a wrong length");
  const std::string_view node = text_in(record.subspan(kHelloBytes));
  if (!hello.side) return malformed("a hello has no side id");
  if (node.size() > kNodeBytesMax) {
    return Error{CloseCode::kTooLarge, "the node name of a hello is longer than 255 bytes"};
  }
  if (!is_text(node)) return malformed("the node name of a hello is not valid text");
  hello.node = node;
  return hello;
}

Result<Login> decode_login(ByteView record) {
  if (auto checked = check(record, kLoginMagic, kLoginBytes); !checked) return checked.error();
  const auto method_bytes = get_le<std::uint16_t>(record, 4);
  const auto credential_bytes = get_le<std::uint16_t>(record, 6);
  if (record.size() != kLoginBytes + std::size_t{method_bytes} + credential_bytes) {
    return malformed("a login has a wrong length");
  }
  const std::string_view method = text_in(record.subspan(kLoginBytes, method_bytes));
  if (!is_method(method)) return malformed("a login's method is not a word of 1 to 32 [a-z0-9_]");
  if (credential_bytes > kCredentialBytesMax) {
    return Error{CloseCode::kTooLarge, "a login's credential is longer than 3900 bytes"};
  }
  const ByteView credential = record.subspan(kLoginBytes + method_bytes);
  return Login{std::string{method}, Bytes{credential.begin(), credential.end()}};
}

Result<Welcome> decode_welcome(ByteView record) {
  if (auto checked = check(record, kWelcomeMagic, kVersionsEnd); !checked) return checked.error();
  Welcome welcome;
  welcome.version = get_le<std::uint16_t>(record, 4);
  // The version comes first, as it gives the layout of the rest.
  if (welcome.version != kProtocolVersion) {
    return Error{CloseCode::kVersion, "the server chose protocol version " +
                                          std::to_string(welcome.version) +
                                          ", which was not offered"};
  }
  if (get_le<std::uint16_t>(record, 6) != 0) {
    return malformed("a reserved byte of a welcome is not zero");
  }
  if (record.size() < kWelcomeBytes) return malformed("a welcome ends too early");
  welcome.dead_after_ms = get_le<std::uint32_t>(record, 8);
  welcome.message_bytes_max = get_le<std::uint32_t>(record, 12);
  welcome.side = get_token(record, 16);
  welcome.session = get_token(record, 32);
  const std::size_t node_bytes = get_le<std::uint16_t>(record, 48);
  const std::size_t identity_bytes = get_le<std::uint16_t>(record, 50);
  if (record.size() != kWelcomeBytes + node_bytes + identity_bytes) {
    return malformed("a welcome has a wrong length");
  }
  const std::string_view node = text_in(record.subspan(kWelcomeBytes, node_bytes));
  const std::string_view identity = text_in(record.subspan(kWelcomeBytes + node_bytes));
  if (!welcome.side || !welcome.session) return malformed("a welcome has no side or session id");
  if (welcome.dead_after_ms != 0 &&
      (welcome.dead_after_ms < kDeadAfterMsMin || welcome.dead_after_ms > kDeadAfterMsMax)) {
    return malformed("a welcome's dead_after_ms is out of range");
  }
  if (node.size() > kNodeBytesMax || identity.size() > kIdentityBytesMax) {
    return Error{CloseCode::kTooLarge, "a welcome's node name or identity is too long"};
  }
  if (!is_text(node) || !is_text(identity)) {
    return malformed("the node name or identity of a welcome is not valid text");
  }
  welcome.node = node;
  welcome.identity = identity;
  return welcome;
}

}  // namespace connect_bridge
