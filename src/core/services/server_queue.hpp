// How many requests a real server can be given before the middleware throws some away.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// Which of the requests that were handed over may still lie in a server's queue, untaken. No graph
// tells the depth of that queue, so it is a rule's `server_queue`: ROS 2's default for services is
// 10, and DDS drops the oldest request of a full queue without a word. A server takes requests in
// their order, so an answer proves that all that was handed over before has been taken, too. One
// that answers nothing for `silence_max` is presumed to have taken what lies there for so long: it
// may be working on that many calls at once. If it is only busy, requests are lost then.
// What nobody waits for any longer lies in the queue all the same: the entries are the queue's, not
// the calls'. Single-threaded; one per service client.
class ServerQueue {
 public:
  // Bounds the memory where nothing else does; beyond, the oldest count as taken.
  static constexpr std::size_t kEntriesMax = 1000;

  explicit ServerQueue(Duration silence_max) : silence_max_(silence_max) {}

  void hand_over(InvocationId request, TimePoint now);
  void answered(InvocationId request, TimePoint now);
  // It could not be sent, or its answer cannot be used.
  void failed(InvocationId request);
  void expire(TimePoint now);
  void clear();

  // Whether one more fits a queue of `depth`, beside those that are `coming`; depth 0: any number.
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
  TimePoint progress_ = TimePoint::min();  // when an answer last proved something
};

}  // namespace connect_bridge
