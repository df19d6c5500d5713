#include "core/graph/claims.hpp"

#include <algorithm>
#include <cstring>
#include <string_view>

namespace connect_bridge {
namespace {

constexpr std::string_view kMark = "connect_bridge claims 1";
constexpr std::size_t kClaimOriginsMax = 65536;
constexpr std::size_t kBridgesMax = 256;

void put_u32(Bytes& out, std::uint32_t v) {
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::uint8_t>(v >> (8 * i)));
}

// CDR strings: length with the terminating zero, aligned to 4 counted after the 4-byte
// encapsulation.
void put_string(Bytes& out, std::string_view text) {
  while (out.size() % 4 != 0) out.push_back(0);
  put_u32(out, static_cast<std::uint32_t>(text.size() + 1));
  out.insert(out.end(), text.begin(), text.end());
  out.push_back(0);
}

// Reads the strings of a Log; all positions are checked.
class Reader {
 public:
  explicit Reader(ByteView bytes) : bytes_(bytes) {}
  bool skip(std::size_t n) { return (at_ += n) <= bytes_.size(); }
  std::optional<std::string_view> string() {
    at_ = (at_ + 3) / 4 * 4;
    if (at_ + 4 > bytes_.size()) return std::nullopt;
    std::uint32_t size = 0;
    for (int i = 0; i < 4; ++i)
      size |= std::uint32_t{bytes_[at_ + static_cast<std::size_t>(i)]} << (8 * i);
    at_ += 4;
    if (size == 0 || size > bytes_.size() - at_) return std::nullopt;
    const auto* begin = reinterpret_cast<const char*>(bytes_.data() + at_);
    at_ += size;
    return std::string_view(begin, size - 1);
  }

 private:
  ByteView bytes_;
  std::size_t at_ = 0;
};

int nibble(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

template <std::size_t N>
bool from_hex(std::string_view text, std::array<std::uint8_t, N>& out) {
  if (text.size() != 2 * N) return false;
  for (std::size_t i = 0; i < N; ++i) {
    const int high = nibble(text[2 * i]);
    const int low = nibble(text[2 * i + 1]);
    if (high < 0 || low < 0) return false;
    out[i] = static_cast<std::uint8_t>(high * 16 + low);
  }
  return true;
}

}  // namespace

std::string to_hex(const std::uint8_t* bytes, std::size_t size) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  text.reserve(2 * size);
  for (std::size_t i = 0; i < size; ++i) {
    text.push_back(kDigits[bytes[i] >> 4]);
    text.push_back(kDigits[bytes[i] & 15]);
  }
  return text;
}

Gid service_gid(std::string_view service) {
  Gid result;
  for (std::size_t word = 0; word < 3; ++word) {
    std::uint64_t hash = 14695981039346656037ULL + word;  // FNV-1a
    const auto add = [&](std::string_view text) {
      for (const char c : text) hash = (hash ^ static_cast<std::uint8_t>(c)) * 1099511628211ULL;
    };
    add("service:");
    add(service);
    for (std::size_t i = 0; i < 8; ++i)
      result.bytes[8 * word + i] = static_cast<std::uint8_t>(hash >> (8 * i));
  }
  return result;
}

Payload serialize(const Claim& claim, Stamp stamp) {
  std::string text = to_hex(claim.side.bytes.data(), claim.side.bytes.size());
  for (const auto& origin : claim.origins)
    text += ' ' + to_hex(origin.bytes.data(), origin.bytes.size());
  Bytes out{0, 1, 0, 0};
  put_u32(out, static_cast<std::uint32_t>(stamp / 1'000'000'000));
  put_u32(out, static_cast<std::uint32_t>(stamp % 1'000'000'000));
  out.push_back(10);  // level DEBUG
  put_string(out, kMark);
  put_string(out, text);
  put_string(out, "");
  put_string(out, "");
  while (out.size() % 4 != 0) out.push_back(0);
  put_u32(out, 0);
  return Payload::adopt(std::move(out));
}

std::optional<Claim> parse_claim(ByteView cdr) {
  if (cdr.size() < 4 || cdr[0] != 0 || cdr[1] != 1) return std::nullopt;
  Reader reader(cdr);
  if (!reader.skip(4 + 8 + 1)) return std::nullopt;
  const auto mark = reader.string();
  const auto text = mark ? reader.string() : std::nullopt;
  if (!text || *mark != kMark) return std::nullopt;
  Claim claim;
  std::string_view rest = *text;
  if (!from_hex(rest.substr(0, rest.find(' ')), claim.side.bytes)) return std::nullopt;
  while (rest.find(' ') != std::string_view::npos && claim.origins.size() < kClaimOriginsMax) {
    rest.remove_prefix(rest.find(' ') + 1);
    Gid gid;
    if (!from_hex(rest.substr(0, rest.find(' ')), gid.bytes)) return std::nullopt;
    claim.origins.push_back(gid);
  }
  return claim;
}

bool Claims::update(const Gid& publisher, Claim claim) {
  if (claim.side == own_) return false;
  if (by_publisher_.size() >= kBridgesMax && !by_publisher_.contains(publisher)) return false;
  by_publisher_[publisher] = std::move(claim);
  rebuild();
  return true;
}

bool Claims::retain(const std::unordered_set<Gid>& before, const std::unordered_set<Gid>& now) {
  const auto gone = std::erase_if(by_publisher_, [&](const auto& entry) {
    return before.contains(entry.first) && !now.contains(entry.first);
  });
  if (gone > 0) rebuild();
  return gone > 0;
}

bool Claims::is_here(const Token128& side) const {
  return std::any_of(by_publisher_.begin(), by_publisher_.end(),
                     [&](const auto& entry) { return entry.second.side == side; });
}

void Claims::rebuild() {
  claimed_.clear();
  taken_.clear();
  for (const auto& [publisher, claim] : by_publisher_) {
    claimed_.insert(claim.origins.begin(), claim.origins.end());
    if (claim.side < own_) taken_.insert(claim.origins.begin(), claim.origins.end());
  }
}

}  // namespace connect_bridge
