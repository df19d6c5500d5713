#include "ros/rcl/publisher_ids.hpp"

namespace connect_bridge::ros {

Gid PublisherIds::id_of(const Gid& told) {
  if (!source_) return told;
  auto found = known_.find(told);
  if (found == known_.end()) {
    refresh();
    found = known_.find(told);
  }
  if (found != known_.end()) return found->second;
  return works_ ? told : Gid{};
}

void PublisherIds::refresh() {
  if (!source_) return;
  for (const PublisherChange& change : source_()) {
    works_ = true;
    if (change.gone) {
      if (known_.contains(change.told)) gone_.push_back(change.told);
    } else if (known_.size() < kKnownMax) {
      known_[change.told] = change.id;
    }
  }
  while (gone_.size() > kGoneMax) {
    known_.erase(gone_.front());
    gone_.pop_front();
  }
}

}  // namespace connect_bridge::ros
