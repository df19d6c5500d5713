// Messages kept for links that are lost and may return.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "core/base/budget.hpp"
#include "core/base/timers.hpp"
#include "core/flow/channel_queue.hpp"
#include "core/flow/rate_limit.hpp"
#include "core/jobs/encoder.hpp"
#include "core/link/link.hpp"
#include "core/topics/origins.hpp"

namespace connect_bridge {

// Messages that nobody gets any more. To free a hundred thousand of them takes milliseconds, so a
// step frees some. Their bytes do not count any longer. Single-threaded.
class DroppedMessages {
 public:
  // Keyed by arrival: a message taken out of the middle moves no other one.
  using Keyed = std::map<std::uint64_t, OutMessage>;

  void add(std::deque<OutMessage> begun, Keyed others, const Now& now) {
    if (begun.empty() && others.empty()) return;
    begun_.push_back(std::move(begun));
    others_.push_back(std::move(others));
    goes_on_at_ = now.steady;
  }
  void free_some();
  // When the rest is to be freed; none: all are.
  [[nodiscard]] std::optional<TimePoint> deadline() const { return goes_on_at_; }

 private:
  static constexpr std::size_t kAtOnce = 16'384;

  std::deque<std::deque<OutMessage>> begun_;
  std::deque<Keyed> others_;
  std::optional<TimePoint> goes_on_at_;
};

class Backlog;
// By bytes, then by age.
using BacklogsByBytes = std::map<std::pair<std::uint64_t, std::uint64_t>, Backlog*>;

// The bound of the backlogs of all lost links of one identity: with many links it keeps no more
// than with one. Beyond the bound the topic with the most bytes drops its oldest message, so a
// camera does not displace the messages of a small topic.
class BacklogBound {
 public:
  // `account`: of the identity.
  BacklogBound(std::shared_ptr<const Account> account, std::uint64_t bytes_max)
      : account_(std::move(account)), bytes_max_(bytes_max) {}

  [[nodiscard]] bool is_of(const Link& link) const { return link.account == account_; }

 private:
  friend class Backlog;
  // Drops messages until the bound holds.
  void keep();

  std::shared_ptr<const Account> account_;
  std::uint64_t bytes_max_;
  std::uint64_t bytes_ = 0;
  std::uint64_t backlogs_ = 0;  // ever made
  BacklogsByBytes by_bytes_;
};

// The backlogs of all topics of one link, which its identity's bound and the room of `memory`, the
// link's budget, limit.
class LinkBacklog {
 public:
  LinkBacklog(std::shared_ptr<BacklogBound> bound, Budget& memory)
      : bound_(std::move(bound)), memory_(memory), bytes_(&memory) {}
  LinkBacklog(const LinkBacklog&) = delete;
  LinkBacklog& operator=(const LinkBacklog&) = delete;

  [[nodiscard]] bool empty() const { return by_bytes_.empty(); }
  [[nodiscard]] const std::shared_ptr<BacklogBound>& bound() const { return bound_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_.used(); }
  // Messages that were resumed, and messages that were lost, since the link was lost.
  [[nodiscard]] std::uint64_t resumed() const { return resumed_; }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }

 private:
  friend class Backlog;
  // Drops messages of this link until `memory` has room.
  void keep();

  std::shared_ptr<BacklogBound> bound_;
  Budget& memory_;
  Budget bytes_;  // of all topics
  std::uint64_t resumed_ = 0;
  std::uint64_t lost_ = 0;
  BacklogsByBytes by_bytes_;
};

// The backlog of one topic, in the order in which it will be sent. Single-threaded.
class Backlog {
 public:
  struct Options {
    Treatment treatment;
    std::string type_hash;
    RateLimits rates;
    Keep keep = Keep::kAll;
    std::uint32_t message_bytes_max = 0;  // largest message that the peer accepts
    std::uint32_t last_sequence = 0;      // number of the last message that was begun
    ExportTimers::Timer ends;  // when the backlog is dropped, unless the link has returned
  };
  Backlog(LinkBacklog& all, Link& link, Options options);
  Backlog(const Backlog&) = delete;
  Backlog& operator=(const Backlog&) = delete;
  ~Backlog();

  // Decides whether a new sample is kept: the same limits apply as on an open link. A refused
  // sample is counted as dropped.
  [[nodiscard]] bool admit(const OutSample& sample, const Now& now);
  // Keeps what may not have arrived on the connection that is lost. The backlog is empty.
  void begin(std::deque<OutMessage> unarrived);
  // Keeps the message. A message with a state replaces an older one that was not begun.
  void add(OutMessage message);
  // Takes out the messages behind `after`, the last one that the peer has. The backlog is empty
  // then.
  [[nodiscard]] std::deque<OutMessage> take(std::uint32_t after);
  // Drops all messages, and counts them under this reason.
  void clear(DropReason reason, DroppedMessages& dropped, const Now& now);
  void drop(DropReason reason, std::uint64_t count = 1);

  // Whether a message of this origin is kept.
  [[nodiscard]] bool holds(OriginId origin) const { return by_origin_.contains(origin); }
  void end_at(ExportTimers::Timer ends) { options_.ends = std::move(ends); }
  [[nodiscard]] TimePoint ends_at() const { return options_.ends.at(); }
  [[nodiscard]] Keep keep() const { return options_.keep; }
  [[nodiscard]] const Treatment& treatment() const { return options_.treatment; }
  [[nodiscard]] const std::string& type_hash() const { return options_.type_hash; }
  [[nodiscard]] std::uint32_t last_sequence() const { return options_.last_sequence; }
  [[nodiscard]] std::size_t size() const { return oldest_.size() + messages_.size(); }
  [[nodiscard]] const DropCounts& dropped() const { return dropped_; }
  [[nodiscard]] Link& link() const { return link_; }

 private:
  friend class BacklogBound;
  friend class LinkBacklog;
  using Messages = DroppedMessages::Keyed;
  using State = std::pair<std::uint32_t, std::uint64_t>;  // subject, state

  // Drops the oldest messages of together so many bytes, the last one wholly.
  void drop_oldest(std::uint64_t bytes, DropReason reason);
  // Both return the bytes of the message.
  std::uint64_t take_out_oldest();
  std::uint64_t take_out(Messages::iterator message);
  void leave(OriginId origin);
  void resize(std::uint64_t bytes);
  [[nodiscard]] std::pair<std::uint64_t, std::uint64_t> place() const {
    return {bytes_.amount(), number_};
  }

  LinkBacklog& all_;
  Link& link_;
  Options options_;
  std::uint64_t number_;  // in the bound
  // The messages that were there when the link was lost, up to the first one that a newer one
  // replaces: they stay as they are, older than all of messages_. There may be a hundred thousand.
  std::deque<OutMessage> oldest_;
  Messages messages_;
  std::uint64_t arrivals_ = 0;
  // Messages with a state that were not begun. Without this map each sample would search all.
  std::map<State, Messages::iterator> states_;
  std::unordered_map<OriginId, std::size_t> by_origin_;  // number of messages per origin
  Budget::Hold bytes_;
  DropCounts dropped_;
};

}  // namespace connect_bridge
