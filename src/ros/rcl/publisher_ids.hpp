// The graph's ids of publishers, for middlewares that report other ids with samples.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/base/ids.hpp"

namespace connect_bridge::ros {

// A publisher that has entered or left the graph.
struct PublisherChange {
  Gid reported;  // the id that the middleware reports with its samples
  Gid id;        // the publisher's id in the graph
  bool gone = false;
};

// Most middlewares report a publisher's graph id with its samples. For a middleware that reports
// its own handle, a source maps handles to publishers. Thread: the loop's.
class PublisherIds {
 public:
  // Returns the changes since its last call.
  using Source = std::function<std::vector<PublisherChange>()>;

  // Without a source `reported` is the graph id.
  explicit PublisherIds(Source source = {}) : source_(std::move(source)) {}

  // The graph id of the publisher whose samples have the id `reported`. An unknown value is
  // returned unchanged: no publisher of the graph has such an id. All zero if the source has never
  // reported anything.
  [[nodiscard]] Gid id_of(const Gid& reported);
  // Takes the changes of the source, so that they do not accumulate there.
  void refresh();

 private:
  // A publisher's last samples are taken after it has left, so its id is kept for a while.
  static constexpr std::size_t kGoneMax = 4096;
  static constexpr std::size_t kKnownMax = 1 << 18;

  const Source source_;
  std::unordered_map<Gid, Gid> known_;  // by `reported`
  std::deque<Gid> gone_;                // ids in known_ of publishers that have left, in order
  bool works_ = false;
};

}  // namespace connect_bridge::ros
