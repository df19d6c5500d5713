// What is kept for links that are lost and may return.
#pragma once

#include <cstdint>
#include <deque>
#include <unordered_map>
#include <vector>

#include "core/base/budget.hpp"
#include "core/base/timers.hpp"
#include "core/flow/channel_queue.hpp"
#include "core/flow/rate_limit.hpp"
#include "core/link/link.hpp"
#include "core/topics/origins.hpp"

namespace connect_bridge {

class Backlog;

// All that is kept for one link, within a bound in bytes and within what is left of `memory`, the
// link's. Beyond it the topic that has most of them gives up its oldest message, so that a camera
// does not cost a small topic its messages.
class LinkBacklog {
 public:
  LinkBacklog(std::uint64_t bytes_max, Budget& memory)
      : bytes_max_(bytes_max), held_(memory.hold(0)) {}
  LinkBacklog(const LinkBacklog&) = delete;
  LinkBacklog& operator=(const LinkBacklog&) = delete;

  [[nodiscard]] bool empty() const { return topics_.empty(); }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  // Messages that went on, and those that did not, since the link was lost.
  [[nodiscard]] std::uint64_t resumed() const { return resumed_; }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }

 private:
  friend class Backlog;
  void change(std::uint64_t difference) {  // modulo 2^64: it may be less
    bytes_ += difference;
    held_.resize(bytes_);
  }
  void keep_bound();

  std::uint64_t bytes_max_;
  std::uint64_t bytes_ = 0;
  Budget::Hold held_;  // of bytes_
  std::uint64_t resumed_ = 0;
  std::uint64_t lost_ = 0;
  std::vector<Backlog*> topics_;  // in the order in which they came
};

// One topic's part of it, in the order in which it will be sent. Single-threaded.
class Backlog {
 public:
  struct Options {
    Treatment treatment;
    RateLimit rate;
    std::uint32_t message_bytes_max = 0;  // largest that the peer took
    std::uint32_t last_sequence = 0;      // of the messages that were begun
    ExportTimers::Timer ends;             // the link has not returned by then
  };
  Backlog(LinkBacklog& all, Link& link, Options options);
  Backlog(const Backlog&) = delete;
  Backlog& operator=(const Backlog&) = delete;
  ~Backlog();

  // Whether a new sample is to be kept: limits hold as they do for a link that is there.
  [[nodiscard]] bool admit(std::size_t bytes, const Now& now);
  void add(OutMessage message);
  // What the peer does not have, if `after` was the last that it got. Empty afterwards.
  [[nodiscard]] std::deque<OutMessage> take(std::uint32_t after);
  // It will not go on: all is dropped for this reason, and nothing is kept any more.
  void end(DropReason reason);
  void drop(DropReason reason, std::uint64_t count = 1);

  // Whether a message of this origin is among them.
  [[nodiscard]] bool holds(OriginId origin) const { return by_origin_.contains(origin); }
  [[nodiscard]] bool is_over() const { return over_; }
  void end_at(ExportTimers::Timer ends) { options_.ends = std::move(ends); }
  [[nodiscard]] TimePoint ends_at() const { return options_.ends.at(); }
  [[nodiscard]] const Treatment& treatment() const { return options_.treatment; }
  [[nodiscard]] std::uint32_t last_sequence() const { return options_.last_sequence; }
  [[nodiscard]] std::size_t size() const { return messages_.size(); }
  [[nodiscard]] const DropCounts& dropped() const { return dropped_; }
  [[nodiscard]] Link& link() const { return link_; }

 private:
  friend class LinkBacklog;
  void drop_oldest(DropReason reason);

  LinkBacklog& all_;
  Link& link_;
  Options options_;
  std::deque<OutMessage> messages_;
  std::unordered_map<OriginId, std::size_t> by_origin_;  // how many of them are of each
  std::uint64_t bytes_ = 0;
  DropCounts dropped_;
  bool over_ = false;
};

}  // namespace connect_bridge
