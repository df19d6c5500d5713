// Origins of a peer topic that have no mirror, because there are too many.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>

#include "core/base/budget.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {

class LeftOutOrigins {
 public:
  // Remembers the origin. Without room it is forgotten, and does not count in the channel's limit.
  void add(const OriginOffer& origin, Budget& memory) {
    const std::uint64_t bytes = kBytes + origin.node.size();
    if (memory.room() >= bytes) known_.emplace(origin.origin, One{origin, memory.hold(bytes)});
  }
  void remove(OriginId id) { known_.erase(id); }
  // Takes the first origin out, if it has a place now.
  std::optional<OriginOffer> take(const std::function<bool(const OriginOffer&)>& has_place) {
    if (known_.empty() || !has_place(known_.begin()->second.origin)) return std::nullopt;
    return std::move(known_.extract(known_.begin()).mapped().origin);
  }

  [[nodiscard]] bool contains(OriginId id) const { return known_.contains(id); }
  [[nodiscard]] std::size_t size() const { return known_.size(); }

 private:
  static constexpr std::uint64_t kBytes = 256;  // to remember one origin, beside its node's name
  struct One {
    OriginOffer origin;
    Budget::Hold bytes;
  };
  std::map<OriginId, One> known_;
};

}  // namespace connect_bridge
