// Two bridges that may be in one graph: what they claim, and what peers are told.
#pragma once

#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "core/graph/claims.hpp"
#include "unit/side/script.hpp"

namespace connect_bridge::side_test {

inline Token128 side_id(std::uint8_t n) {
  Token128 id;
  id.bytes.fill(n);
  return id;
}

// A claim whose sample does not tell its publisher.
inline void say_claim(Script& s, Claim claim) {
  s.give(MessageTaken{{1}, Gid{}, 0, serialize(claim, 0)});
}

inline Accepts with_neighbours(std::vector<Token128> sides) {
  Accepts accepts{{{{"/**"}, {}}}, {}};
  accepts.neighbours = std::move(sides);
  return accepts;
}

// The neighbours that the peer is told of now; nothing: of none.
inline std::optional<std::vector<Token128>> told(Script& s, std::uint32_t connection) {
  std::optional<std::vector<Token128>> sides;
  while (const auto packet = s.side.next_packet({connection}, flow_test::now_ms(s.at))) {
    if (!packet->text) continue;
    const Bytes bytes = flow_test::joined(*packet);
    const auto control = decode_control(std::string(bytes.begin(), bytes.end()));
    if (const auto* accepts = std::get_if<Accepts>(&control.value())) sides = accepts->neighbours;
  }
  return sides;
}

// A peer logs in, and says what it accepts and in which domain it is. What it is told of.
inline std::optional<std::vector<Token128>> arrive(Script& s, std::uint32_t connection,
                                                   std::optional<std::uint32_t> domain = {},
                                                   const Identity& who = {}) {
  s.login(connection, {}, who);
  const auto first = told(s, connection);
  Accepts accepts = with_neighbours({});
  accepts.domain = domain;
  s.say(connection, accepts);
  const auto then = told(s, connection);
  return then ? then : first;
}

using Sides = std::vector<Token128>;

// What another bridge says of its peer in this domain, and in the network "here".
inline Place place_in(std::uint32_t domain) {
  Script other(server());
  other.site = "here";
  arrive(other, 1, domain);
  other.pass(20);
  Place place;
  while (const auto action = other.side.next_action())
    if (const auto* publish = std::get_if<Publish>(&*action))
      if (const auto claim = parse_claim(publish->payload.view()); claim && !claim->peers.empty())
        place = claim->peers.at(0).place;
  return place;
}

}  // namespace connect_bridge::side_test
