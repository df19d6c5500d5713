#include "core/link/accepts_review.hpp"

#include <algorithm>

namespace connect_bridge {
namespace {

bool lacks(const Link& link) {
  return link.accepts && link.accepts->lacks();
}

}  // namespace

std::vector<Link*> AcceptsReview::take_done(LinkTable& links, const Now& now) {
  if (due_ > now.steady) return {};
  std::vector<Link*> done;
  while (Link* const next = in_turn(links, now)) {
    if (!pace_.ready(now.steady)) {
      due_ = std::max(now.steady + kPeriod, pace_.ready_at());
      break;
    }
    last_ = next->id;
    compare(next->accepts, now);
    if (lacks(*next)) continue;
    next->accepts->rest_until(now.steady + kPause);
    done.push_back(next);
  }
  return done;
}

// Null: nothing is to be compared now.
Link* AcceptsReview::in_turn(LinkTable& links, const Now& now) const {
  auto it = links.upper_bound(last_);
  for (std::size_t i = 0; i < links.size(); ++i, ++it) {
    if (it == links.end()) it = links.begin();
    if (lacks(it->second) && it->second.accepts->rests_until() <= now.steady) return &it->second;
  }
  return nullptr;
}

std::optional<TimePoint> AcceptsReview::deadline(const LinkTable& links) const {
  std::optional<TimePoint> first;
  for (const auto& [id, link] : links)
    if (lacks(link)) first = earliest(first, std::max(due_, link.accepts->rests_until()));
  return first;
}

// One turn: as much as costs the same for all, but one comparison at the least.
void AcceptsReview::compare(LinkAccepts& accepts, const Now& now) {
  double spent = 0;
  while (accepts->lacks() && spent < kTurn) spent += static_cast<double>(accepts->compare());
  pace_.take(spent, now.steady);
}

}  // namespace connect_bridge
