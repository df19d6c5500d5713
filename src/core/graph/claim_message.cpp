#include "core/graph/claim_message.hpp"

#include <algorithm>
#include <charconv>
#include <span>
#include <string>
#include <string_view>

#include "core/base/cdr.hpp"
#include "core/base/hex.hpp"

namespace connect_bridge {
namespace {

constexpr std::string_view kMark = "connect_bridge claims 5";
// Words after the side's id: an origin, or one of these marks and the text that follows it.
constexpr char kMirror = '=';
constexpr char kService = '/';
constexpr char kGoodFor = '~';       // milliseconds
constexpr std::uint8_t kDebug = 10;  // rcl_interfaces/msg/Log

// The first entries, as many as a claim may have.
template <class T>
std::span<const T> first_of(const std::vector<T>& all, std::size_t count_max) {
  return std::span(all).first(std::min(all.size(), count_max));
}

// Entries beyond the limit are dropped, but each must still be a valid word (docs/protocol.md
// section 12).
bool take(std::string_view hex, std::vector<Gid>& ids, std::size_t before = 0) {
  Gid id;
  if (!from_hex(hex, id.bytes)) return false;
  if (before + ids.size() < kClaimOriginsMax) ids.push_back(id);
  return true;
}

bool take_time(std::string_view digits, Duration& time) {
  std::int64_t ms = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), ms);
  const bool is_number = error == std::errc{} && end == digits.data() + digits.size();
  // A longer time would let a bridge that is long gone hold its origins (docs/protocol.md section
  // 12).
  if (!is_number || ms < 0 || ms > kClaimGoodMax / std::chrono::milliseconds(1)) return false;
  time = std::chrono::milliseconds(ms);
  return true;
}

// Adds one word to the claim. False: the word is not valid in a claim.
bool take(std::string_view word, Claim& claim) {
  const char kind = word.empty() ? ' ' : word.front();
  if (kind == kMirror) return take(word.substr(1), claim.mirrors);
  if (kind == kGoodFor) return take_time(word.substr(1), claim.good_for);
  if (kind == kService) return take(word.substr(1), claim.services, claim.origins.size());
  return take(word, claim.origins, claim.services.size());
}

}  // namespace

std::size_t claim_bytes(const Claim& claim) {
  return 256 + 50 * (claim.mirrors.size() + claim.origins.size() + claim.services.size());
}

// Claims are long beside peers with thousands of topics, and every change serializes them again.
Payload serialize(const Claim& claim, Stamp stamp) {
  std::string text;
  text.reserve(claim_bytes(claim));
  append_hex(claim.side.bytes, text);
  if (claim.good_for <= kClaimGoodMax)
    text +=
        std::string(" ") + kGoodFor + std::to_string(claim.good_for / std::chrono::milliseconds(1));
  const auto add = [&](std::string_view before, const Gid& id) {
    text += before;
    append_hex(id.bytes, text);
  };
  for (const Gid& mirror : first_of(claim.mirrors, kClaimOriginsMax)) add(" =", mirror);
  // Services come first if there is no room for all. An origin with two mirrors repeats its
  // samples; two servers of one name execute each call twice.
  const auto services = first_of(claim.services, kClaimOriginsMax);
  for (const Gid& service : services) add(" /", service);
  for (const Gid& origin : first_of(claim.origins, kClaimOriginsMax - services.size()))
    add(" ", origin);
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
  // Stamp and level do not count. After one failed read all later reads fail, so only the last text
  // is checked.
  reader.u32();
  reader.u32();
  reader.u8();
  const auto mark = reader.string();
  const auto text = reader.string();
  if (!text || *mark != kMark) return std::nullopt;
  Claim claim;
  claim.good_for = kClaimGoodDefault;
  std::string_view rest = *text;
  if (!from_hex(rest.substr(0, rest.find(' ')), claim.side.bytes)) return std::nullopt;
  while (rest.find(' ') != std::string_view::npos) {
    rest.remove_prefix(rest.find(' ') + 1);
    if (!take(rest.substr(0, rest.find(' ')), claim)) return std::nullopt;
  }
  return claim;
}

}  // namespace connect_bridge
