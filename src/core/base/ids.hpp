// Strong integer ids: a channel number cannot be passed where a link number is meant.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <functional>

namespace connect_bridge {

// Ids on the wire have 32 bits; ids that only this process counts have 64, which no peer can
// exhaust.
template <class Tag, class Value = std::uint64_t>
struct Id {
  Value value = 0;  // 0 means "none"
  auto operator<=>(const Id&) const = default;
  explicit operator bool() const { return value != 0; }
};

using ConnectionId = Id<struct ConnectionTag>;        // one WebSocket, unique in this process
using LinkId = Id<struct LinkTag>;                    // one peer, unique in this process
using SubscriptionId = Id<struct SubscriptionTag>;    // a subscription held by an exporter
using MirrorId = Id<struct MirrorTag>;                // a publisher held by an importer
using ServiceMirrorId = Id<struct ServiceMirrorTag>;  // a service server held by an importer
using ServiceClientId = Id<struct ServiceClientTag>;  // a service client held by an exporter
using RequestId = Id<struct RequestTag>;              // a request taken at a service mirror
using InvocationId = Id<struct InvocationTag>;        // a request handed to a real service
using JobId = Id<struct JobTag>;                      // a piece of work given to a worker
using PictureId = Id<struct PictureTag>;  // pictures of one origin that refer to each other

// On the wire.
using ChannelId = Id<struct ChannelTag, std::uint32_t>;  // of its sender, unique on one link
using OriginId = Id<struct OriginTag, std::uint32_t>;    // of the exporter, unique in one channel
using ListenerId =
    Id<struct ListenerTag, std::uint32_t>;         // of its sender, unique on one connection
using CallId = Id<struct CallTag, std::uint32_t>;  // of the importer, rising on one channel

// The subject of a message: the origin of a sample, or a call. The kind of channel says which.
struct Subject {
  std::uint32_t value = 0;
  constexpr Subject() = default;
  constexpr Subject(std::uint32_t number) : value(number) {}
  constexpr Subject(OriginId origin) : value(origin.value) {}
  constexpr Subject(CallId call) : value(call.value) {}
  [[nodiscard]] constexpr OriginId origin() const { return {value}; }
  [[nodiscard]] constexpr CallId call() const { return {value}; }
  bool operator==(const Subject&) const = default;
  explicit operator bool() const { return value != 0; }
};

// The graph's own id of an endpoint (rmw_gid_t, 24 bytes at most, padded with zeros).
struct Gid {
  std::array<std::uint8_t, 24> bytes{};
  auto operator<=>(const Gid&) const = default;
};

// Identifies one running side (random, new at each start) or one session (random, secret).
struct Token128 {
  std::array<std::uint8_t, 16> bytes{};
  auto operator<=>(const Token128&) const = default;
  explicit operator bool() const { return *this != Token128{}; }
};

}  // namespace connect_bridge

template <class Tag, class Value>
struct std::hash<connect_bridge::Id<Tag, Value>> {
  std::size_t operator()(connect_bridge::Id<Tag, Value> id) const noexcept { return id.value; }
};

template <>
struct std::hash<connect_bridge::Gid> {
  std::size_t operator()(const connect_bridge::Gid& gid) const noexcept {
    std::size_t h = 1469598103934665603ULL;  // FNV-1a
    for (auto b : gid.bytes) h = (h ^ b) * 1099511628211ULL;
    return h;
  }
};
