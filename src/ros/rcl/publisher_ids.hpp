// The graph's ids of publishers, for middlewares that give other ids with samples.
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
  Gid told;  // what the middleware gives with its samples
  Gid id;    // its id in the graph
  bool gone = false;
};

// Most middlewares give a publisher's graph id with its samples. For one that gives a handle of its
// own instead, a source says which publisher that is. Thread: the loop's.
class PublisherIds {
 public:
  // Returns what has changed since it was last called.
  using Source = std::function<std::vector<PublisherChange>()>;

  // Without a source `told` is the id.
  explicit PublisherIds(Source source = {}) : source_(std::move(source)) {}

  // The graph id of the publisher whose samples have the id `told`. An unknown value is returned
  // unchanged: no publisher of the graph has such an id. All zero if the source has never reported
  // anything.
  [[nodiscard]] Gid id_of(const Gid& told);
  // Takes what the source has, so that it does not accumulate there.
  void refresh();

 private:
  // A publisher's last samples are taken after it has left.
  static constexpr std::size_t kGoneMax = 4096;
  static constexpr std::size_t kKnownMax = 1 << 18;

  const Source source_;
  std::unordered_map<Gid, Gid> known_;  // by `told`
  std::deque<Gid> gone_;                // of these, in order
  bool works_ = false;
};

}  // namespace connect_bridge::ros
