// The interfaces that the peer of a link would import: the list that holds, and the one that waits
// to be read.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/pace.hpp"
#include "core/base/time.hpp"
#include "core/policy/peer_accepts.hpp"

namespace connect_bridge {

// After each new list all interfaces are compared with it again, and offered or withdrawn. A list
// that comes too soon after others waits; if several wait, only the last one counts. Works like an
// optional: there is no list until the first one of a connection holds. Single-threaded.
class LinkAccepts {
 public:
  // `of_account`: the pace of all links of its identity together. It outlives this object.
  explicit LinkAccepts(Pace& of_account) : of_account_(of_account) {}

  // ---- the list that holds
  explicit operator bool() const { return list_.has_value(); }
  [[nodiscard]] const PeerAccepts* operator->() const { return &*list_; }
  // The list that was taken holds from now on. False: it equals the one before.
  bool adopt(Accepts list) {
    // A list that we skipped may have made the peer decline what this list accepts again.
    const bool passed_over = std::exchange(passed_over_, false);
    if (list_ && !passed_over && list_->list() == list) return false;
    list_.emplace(std::move(list));
    ++lists_;
    return true;
  }
  // Number of lists that have held: a channel declined under another list may be offered again.
  [[nodiscard]] std::uint64_t lists() const { return lists_; }
  // Do the present offers complete the connection's first round of offers? True once.
  [[nodiscard]] bool take_completion() { return !std::exchange(completed_, true); }

  // ---- the list that waits
  // A list has come; the caller asks take_due() at once.
  void put(Accepts list, const Now& now) {
    passed_over_ = passed_over_ || waiting_;
    waiting_ = std::move(list);
    due_ = now.steady;
  }
  // The list, if it is due now; it is counted in the paces. `opened_at`: when the connection
  // opened.
  [[nodiscard]] std::optional<Accepts> take_due(TimePoint opened_at, const Now& now) {
    if (!due_ || *due_ > now.steady) return std::nullopt;
    due_ = due(opened_at, now);  // lists of other links may have been read meanwhile
    if (*due_ > now.steady) return std::nullopt;
    due_.reset();
    // The first list of a connection may come before its time. Then it is not counted, or the pace
    // would fall behind with each connection.
    for (Pace* const pace : {&pace_, &of_account_}) static_cast<void>(pace->take(now.steady));
    return std::exchange(waiting_, std::nullopt);
  }
  [[nodiscard]] std::optional<TimePoint> deadline() const { return due_; }

  // The connection is lost, and with it the peer's `accepts`.
  void lost() {
    list_.reset();
    completed_ = false;
    waiting_.reset();
    due_.reset();
    passed_over_ = false;
  }

 private:
  // The first list of a connection waits no longer than this after the connection was opened. The
  // peer keeps the mirrors of an earlier connection for 30 s (protocol.md section 7). So the first
  // offers reach it long before that, however many other lists come before its own.
  static constexpr Duration kFirstMax = std::chrono::seconds(10);

  [[nodiscard]] TimePoint due(TimePoint opened_at, const Now& now) const {
    const TimePoint free_at = std::max(pace_.free_at(), of_account_.free_at());
    return std::max(now.steady, list_ ? free_at : std::min(free_at, opened_at + kFirstMax));
  }

  Pace& of_account_;
  std::optional<PeerAccepts> list_;
  std::uint64_t lists_ = 0;
  bool completed_ = false;  // our first round of offers has been sent
  std::optional<Accepts> waiting_;
  std::optional<TimePoint> due_;  // with `waiting_`: the list is not read before
  bool passed_over_ = false;      // a list was replaced while it waited
  Pace pace_{20, std::chrono::seconds(1)};
};

}  // namespace connect_bridge
