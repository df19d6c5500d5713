#include "net/tcp/proxy_header.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/ip/network_v4.hpp>
#include <boost/asio/ip/network_v6.hpp>
#include <charconv>
#include <cstring>
#include <string>

namespace connect_bridge {
namespace {

namespace ip = boost::asio::ip;
using State = ProxyHeader::State;

constexpr std::string_view kSignature2{"\r\n\r\n\0\r\nQUIT\n", 12};
constexpr std::string_view kWord1 = "PROXY ";
constexpr std::size_t kFirstBytes = 15;  // "PROXY UNKNOWN\r\n" is the shortest of version 1
constexpr std::size_t kLine1Max = 107;
constexpr std::size_t kHead2 = 16;
constexpr std::size_t kBody2Max = 2048;  // addresses need 36; we do not read the rest
constexpr std::uint8_t kTcp4 = 0x11, kTcp6 = 0x21;
constexpr std::size_t kEntriesMax = 100;

ProxyHeader wrong() {
  return {State::kWrong, 0, {}};
}
ProxyHeader more(std::size_t missing) {
  return {State::kMore, missing, {}};
}
ProxyHeader complete(std::optional<Source> source) {
  return {State::kComplete, 0, std::move(source)};
}

template <class Number>
std::optional<Number> number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

std::optional<ip::address> address_of(std::string_view text) {
  // A zone ("%eth0") has a meaning only on the machine that wrote it.
  if (text.size() > 45 || text.find('%') != std::string_view::npos) return std::nullopt;
  boost::system::error_code error;
  const ip::address address = ip::make_address(std::string{text}, error);
  if (error) return std::nullopt;
  return plain_address(address);
}

// Takes the next word of a line of version 1.
std::string_view take_word(std::string_view& rest) {
  const std::size_t space = rest.find(' ');
  const std::string_view word = rest.substr(0, space);
  rest = space == std::string_view::npos ? std::string_view{} : rest.substr(space + 1);
  return word;
}

ProxyHeader line1(std::string_view line) {
  std::string_view rest = line.substr(kWord1.size());
  const std::string_view family = take_word(rest);
  if (family == "UNKNOWN") return complete({});
  const auto source = address_of(take_word(rest));
  const auto target = address_of(take_word(rest));
  const auto source_port = number<std::uint16_t>(take_word(rest));
  const auto target_port = number<std::uint16_t>(take_word(rest));
  if ((family != "TCP4" && family != "TCP6") || !source || !target || !source_port ||
      !target_port || !rest.empty())
    return wrong();
  return complete(Source{*source, *source_port});
}

ProxyHeader version1(std::string_view text) {
  const std::size_t end = text.find('\n');
  if (end == std::string_view::npos) return text.size() >= kLine1Max ? wrong() : more(1);
  if (end + 1 != text.size() || text.size() > kLine1Max || end == 0 || text[end - 1] != '\r')
    return wrong();
  return line1(text.substr(0, end - 1));
}

std::uint16_t big_endian(ByteView bytes) {
  return static_cast<std::uint16_t>(bytes[0] << 8U | bytes[1]);
}

ProxyHeader version2(ByteView bytes) {
  if (bytes.size() < kHead2) return more(kHead2 - bytes.size());
  const std::uint8_t command = bytes[12];
  const std::uint8_t family = bytes[13];
  const std::size_t body = big_endian(bytes.subspan(14));
  if ((command != 0x20 && command != 0x21) || body > kBody2Max) return wrong();
  if (bytes.size() < kHead2 + body) return more(kHead2 + body - bytes.size());
  if (bytes.size() > kHead2 + body) return wrong();
  // LOCAL: the proxy connects for itself, to check that we are alive.
  if (command == 0x20 || (family != kTcp4 && family != kTcp6)) return complete({});
  const ByteView rest = bytes.subspan(kHead2);
  const std::size_t size = family == kTcp4 ? 4 : 16;
  if (rest.size() < 2 * size + 4) return wrong();
  Source source;
  if (family == kTcp4) {
    ip::address_v4::bytes_type octets;
    std::copy_n(rest.begin(), octets.size(), octets.begin());
    source.address = ip::address_v4{octets};
  } else {
    ip::address_v6::bytes_type octets;
    std::copy_n(rest.begin(), octets.size(), octets.begin());
    source.address = plain_address(ip::address_v6{octets});
  }
  source.port = big_endian(rest.subspan(2 * size));
  return complete(source);
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t";
  const std::size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kSpace) - begin + 1);
}

// Parses "192.0.2.1", "192.0.2.1:4711", "2001:db8::1", "[2001:db8::1]:4711".
std::optional<Source> source_of(std::string_view text) {
  std::string_view port;
  if (!text.empty() && text.front() == '[') {
    const std::size_t end = text.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    port = text.substr(end + 1);
    text = text.substr(1, end - 1);
  } else if (std::count(text.begin(), text.end(), ':') == 1) {
    const std::size_t colon = text.find(':');
    port = text.substr(colon);
    text = text.substr(0, colon);
  }
  const auto address = address_of(text);
  if (!address) return std::nullopt;
  if (port.empty()) return Source{*address, 0};
  const auto parsed = port.front() == ':' ? number<std::uint16_t>(port.substr(1)) : std::nullopt;
  return Source{*address, parsed.value_or(0)};
}

}  // namespace

std::optional<AddressRange> AddressRange::parse(std::string_view text) {
  const std::size_t slash = text.find('/');
  const auto address = address_of(text.substr(0, slash));
  if (!address) return std::nullopt;
  const std::uint16_t bits_max = address->is_v4() ? 32 : 128;
  const auto bits =
      slash == std::string_view::npos ? bits_max : number<std::uint16_t>(text.substr(slash + 1));
  if (!bits || *bits > bits_max) return std::nullopt;
  return AddressRange(*address, *bits);
}

bool AddressRange::contains(const ip::address& address) const {
  // Zones ("%eth0") do not matter.
  const auto same = [](const auto& a, const auto& b) {
    return a.network().to_bytes() == b.network().to_bytes();
  };
  if (address.is_v4() != first_.is_v4()) return false;
  if (address.is_v4())
    return same(ip::network_v4(first_.to_v4(), bits_), ip::network_v4(address.to_v4(), bits_));
  return same(ip::network_v6(first_.to_v6(), bits_), ip::network_v6(address.to_v6(), bits_));
}

bool contain(const AddressRanges& ranges, const ip::address& address) {
  return std::any_of(ranges.begin(), ranges.end(),
                     [&](const AddressRange& range) { return range.contains(address); });
}

ip::address plain_address(const ip::address& address) {
  if (address.is_v6() && address.to_v6().is_v4_mapped())
    return ip::make_address_v4(ip::v4_mapped, address.to_v6());
  return address;
}

std::string network_of(const ip::address& address, int bytes) {
  if (address.is_v4()) return address.to_string();
  auto all = address.to_v6().to_bytes();
  std::fill(all.begin() + bytes, all.end(), static_cast<unsigned char>(0));
  return ip::make_address_v6(all).to_string();
}

ProxyHeader read_proxy_header(ByteView bytes) {
  const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  const auto may_be = [&](std::string_view begin) {
    const std::size_t known = std::min(begin.size(), text.size());
    return text.substr(0, known) == begin.substr(0, known);
  };
  if (!may_be(kSignature2) && !may_be(kWord1)) return wrong();
  if (bytes.size() < kFirstBytes) return more(kFirstBytes - bytes.size());
  return may_be(kWord1) ? version1(text) : version2(bytes);
}

std::optional<Source> forwarded_source(const std::vector<std::string_view>& lines,
                                       const AddressRanges& trusted) {
  std::optional<Source> known;
  std::size_t seen = 0;
  for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
    for (std::string_view rest = *line;;) {
      const std::size_t comma = rest.rfind(',');
      const bool last = comma == std::string_view::npos;
      const auto source = source_of(trimmed(last ? rest : rest.substr(comma + 1)));
      if (!source || ++seen > kEntriesMax) return known;
      known = source;
      if (!contain(trusted, source->address)) return known;  // mutant: proxy_trusted
      if (last) break;
      rest = rest.substr(0, comma);
    }
  }
  return known;
}

}  // namespace connect_bridge
