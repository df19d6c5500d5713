#include "core/link/accepts_review.hpp"

#include <algorithm>

namespace connect_bridge {

std::vector<Link*> AcceptsReview::take_done(LinkTable& links, const Now& now) {
  if (due_ && *due_ > now.steady) return {};
  due_.reset();
  std::vector<Link*> done;
  auto it = links.upper_bound(last_);
  for (std::size_t i = 0; i < links.size(); ++i, ++it) {
    if (it == links.end()) it = links.begin();
    Link& link = it->second;
    if (!link.accepts || !link.accepts->lacks()) continue;
    if (compare(*link.accepts, now)) {
      done.push_back(&link);
      continue;
    }
    last_ = link.id;
    due_ = std::max(now.steady + kPeriod, pace_.ready_at());
    break;
  }
  return done;
}

bool AcceptsReview::compare(PeerAccepts& accepts, const Now& now) {
  while (accepts.lacks()) {
    if (!pace_.ready(now.steady)) return false;
    pace_.take(static_cast<double>(accepts.cost()), now.steady);
    accepts.compare();
  }
  return true;
}

}  // namespace connect_bridge
