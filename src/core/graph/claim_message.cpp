#include "core/graph/claim_message.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include "core/base/cdr.hpp"
#include "core/base/hex.hpp"

namespace connect_bridge {
namespace {

constexpr std::string_view kMark = "connect_bridge claims 2";
constexpr char kFeeds = '+';         // follows an origin
constexpr std::uint8_t kDebug = 10;  // rcl_interfaces/msg/Log

}  // namespace

Payload serialize(const Claim& claim, Stamp stamp) {
  std::string text = to_hex(claim.side.bytes);
  const std::size_t count = std::min(claim.origins.size(), kClaimOriginsMax);
  for (std::size_t i = 0; i < count; ++i) {
    text += ' ' + to_hex(claim.origins[i].gid.bytes);
    if (claim.origins[i].feeds) text += kFeeds;
  }
  return CdrWriter()
      .u32(static_cast<std::uint32_t>(stamp / 1'000'000'000))
      .u32(static_cast<std::uint32_t>(stamp % 1'000'000'000))
      .u8(kDebug)
      .string(kMark)  // name
      .string(text)   // msg
      .string("")     // file
      .string("")     // function
      .u32(0)         // line
      .take();
}

std::optional<Claim> parse_claim(ByteView cdr) {
  CdrReader reader(cdr);
  reader.u32();
  reader.u32();
  reader.u8();
  const auto mark = reader.string();
  const auto text = reader.string();
  if (!text || *mark != kMark) return std::nullopt;
  Claim claim;
  std::string_view rest = *text;
  if (!from_hex(rest.substr(0, rest.find(' ')), claim.side.bytes)) return std::nullopt;
  while (rest.find(' ') != std::string_view::npos && claim.origins.size() < kClaimOriginsMax) {
    rest.remove_prefix(rest.find(' ') + 1);
    std::string_view word = rest.substr(0, rest.find(' '));
    ClaimedOrigin origin;
    origin.feeds = word.ends_with(kFeeds);
    if (origin.feeds) word.remove_suffix(1);
    if (!from_hex(word, origin.gid.bytes)) return std::nullopt;
    claim.origins.push_back(origin);
  }
  return claim;
}

}  // namespace connect_bridge
