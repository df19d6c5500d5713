// A small number for each link that there is, for names that must not come without end.
#pragma once

#include <cstdint>
#include <vector>

#include "core/ports/status.hpp"

namespace connect_bridge {

// The lowest that is free is given: those of links that have ended serve again.
class LinkPlaces {
 public:
  // The links that there are now.
  void follow(const std::vector<LinkStatus>& links);
  // From 1 on; of a link of the last follow().
  [[nodiscard]] std::size_t of(const LinkStatus& link) const;

 private:
  std::vector<std::uint64_t> places_;  // the number of the link there; 0: free
};

}  // namespace connect_bridge
