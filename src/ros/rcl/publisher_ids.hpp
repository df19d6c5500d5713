// The graph's ids of publishers, where the middleware tells others.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/base/ids.hpp"

namespace connect_bridge::ros {

// A publisher has come into the graph, or has left it.
struct PublisherChange {
  Gid told;  // what the middleware tells with its samples
  Gid id;    // its id in the graph
  bool gone = false;
};

// Most middlewares tell a publisher's id of the graph with its samples. Of one that tells a handle
// of its own instead, a source says which publisher that is. Thread: the loop's.
class PublisherIds {
 public:
  // What has changed since it was asked last.
  using Source = std::function<std::vector<PublisherChange>()>;

  // Without a source what is told is the id.
  explicit PublisherIds(Source source = {}) : source_(std::move(source)) {}

  // The id of the publisher of which the middleware tells this. What nobody knows stays as it is:
  // no publisher of the graph has such an id. All zero if the source has never said anything.
  [[nodiscard]] Gid id_of(const Gid& told);
  // Takes what the source has, so that it does not pile up there.
  void refresh();

 private:
  // A publisher's last samples are taken after it has left.
  static constexpr std::size_t kGoneMax = 4096;
  static constexpr std::size_t kKnownMax = 1 << 18;

  const Source source_;
  std::unordered_map<Gid, Gid> known_;  // by what is told
  std::deque<Gid> gone_;                // of these, in order
  bool works_ = false;
};

}  // namespace connect_bridge::ros
