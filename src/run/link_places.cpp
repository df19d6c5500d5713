#include "run/link_places.hpp"

#include <algorithm>

namespace connect_bridge {

void LinkPlaces::follow(const std::vector<LinkStatus>& links) {
  const auto has = [](const auto& all, const auto& is) {
    return std::any_of(all.begin(), all.end(), is);
  };
  for (auto& place : places_)
    if (!has(links, [&](const LinkStatus& link) { return link.number == place; })) place = 0;
  for (const LinkStatus& link : links) {
    if (has(places_, [&](std::uint64_t place) { return place == link.number; })) continue;
    auto free = std::find(places_.begin(), places_.end(), 0U);
    if (free == places_.end()) free = places_.insert(free, 0);
    *free = link.number;
  }
}

std::size_t LinkPlaces::of(const LinkStatus& link) const {
  const auto place = std::find(places_.begin(), places_.end(), link.number);
  return static_cast<std::size_t>(place - places_.begin()) + 1;
}

}  // namespace connect_bridge
