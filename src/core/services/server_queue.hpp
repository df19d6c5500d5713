// Counts the requests that a real server can get before the middleware drops some.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// Tracks the handed-over requests that may still wait in the server's queue. The graph does not
// contain the depth of that queue, so a rule's `server_queue` states it. ROS 2's default for
// services is 10, and DDS silently drops the oldest request of a full queue.
//
// A server takes requests in their order, so an answer proves that all earlier requests have
// been taken, too. A server without an answer for `silence_max` is presumed to have taken requests
// of that age: it may work on so many calls at once. If it is only busy, requests are lost then.
//
// A request stays in the queue even if nobody waits for it: entries belong to the queue, not to
// calls. Single-threaded; one per service client.
class ServerQueue {
 public:
  // Limits the memory if nothing else does. Beyond it the oldest requests count as taken.
  static constexpr std::size_t kEntriesMax = 1000;

  explicit ServerQueue(Duration silence_max) : silence_max_(silence_max) {}

  void hand_over(InvocationId request, TimePoint now);
  void answered(InvocationId request, TimePoint now);
  // The request could not be sent, or its answer cannot be used.
  void failed(InvocationId request);
  void expire(TimePoint now);
  void clear();

  // True if one more request fits into a queue of `depth`, in addition to `coming` ones. Depth 0:
  // no limit.
  [[nodiscard]] bool has_room(std::size_t depth, std::size_t coming, TimePoint now);
  [[nodiscard]] std::size_t size() const { return untaken_.size(); }
  // The next time at which expire() removes something.
  [[nodiscard]] std::optional<TimePoint> deadline() const;

 private:
  struct Entry {
    InvocationId request;
    TimePoint handed_over{};
  };
  Duration silence_max_;
  std::deque<Entry> untaken_;
  TimePoint progress_ = TimePoint::min();  // when an answer last proved that requests were taken
};

}  // namespace connect_bridge
