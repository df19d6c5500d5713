// How many requests a real server can get before the middleware drops some.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// Tracks which of the requests that were handed over may still wait in the server's queue. The
// graph does not contain the depth of that queue, so it is a rule's `server_queue`: ROS 2's default
// for services is 10, and DDS silently drops the oldest request of a full queue. A server takes
// requests in their order, so an answer proves that all that was handed over before has been taken,
// too. A server that gives no answer for `silence_max` is presumed to have taken the requests that
// are as old as that: it may be working on so many calls at once. If it is only busy, requests are
// lost then. A request for which nobody waits any longer is still in the queue: an entry belongs to
// the queue, not to a call. Single-threaded; one per service client.
class ServerQueue {
 public:
  // Limits the memory where nothing else does; beyond it the oldest requests count as taken.
  static constexpr std::size_t kEntriesMax = 1000;

  explicit ServerQueue(Duration silence_max) : silence_max_(silence_max) {}

  void hand_over(InvocationId request, TimePoint now);
  void answered(InvocationId request, TimePoint now);
  // The request could not be sent, or its answer cannot be used.
  void failed(InvocationId request);
  void expire(TimePoint now);
  void clear();

  // Whether one more fits into a queue of `depth`, in addition to the `coming` ones; depth 0: no
  // limit.
  [[nodiscard]] bool has_room(std::size_t depth, std::size_t coming, TimePoint now);
  [[nodiscard]] std::size_t size() const { return untaken_.size(); }
  // When expire() will find something.
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
