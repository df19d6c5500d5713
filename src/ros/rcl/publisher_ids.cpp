#include "ros/rcl/publisher_ids.hpp"

namespace connect_bridge::ros {

Gid PublisherIds::id_of(const Gid& reported) {
  if (!source_) return reported;
  auto found = known_.find(reported);
  if (found == known_.end()) {
    refresh();
    found = known_.find(reported);
  }
  if (found != known_.end()) return found->second;
  return works_ ? reported : Gid{};
}

void PublisherIds::refresh() {
  if (!source_) return;
  for (const PublisherChange& change : source_()) {
    works_ = true;
    if (change.gone) {
      if (known_.contains(change.reported)) gone_.push_back(change.reported);
    } else if (known_.size() < kKnownMax) {
      known_[change.reported] = change.id;
    }
  }
  while (gone_.size() > kGoneMax) {
    known_.erase(gone_.front());
    gone_.pop_front();
  }
}

}  // namespace connect_bridge::ros
