// Chooses the call that a real server gets next.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/services/server_queue.hpp"

namespace connect_bridge {

// The scheduler of the calls that peers make at one service. Calls are known only by their ids. A
// call waits until next() returns it for the hand-over to the server, and takes one of its caller's
// places until it leaves. A caller is a link. The links of one identity share its places, and
// each has one at least.
//
// Identities with a call that may begin take turns, one call each time, and the links of one among
// themselves: neither a link with a thousand calls nor an identity with many links delays others.
// They share the server's short queue: a call begins only if the queue has
// room. The calls of one caller begin in the order of their numbers; while a worker prepares
// (decompresses) one, the later ones wait. A call for the result of an action lasts as long as its
// goal, so its callers have more places.
//
// Call next() until it returns nothing, after every change that may let a call begin and at the
// deadline. Pure: no outputs, no links. Single-threaded.
class CallGate {
 public:
  struct Next {
    LinkId caller;
    CallId call;
  };
  // The terms that a rule grants a caller.
  struct Terms {
    std::uint32_t places = 1;
    std::uint32_t queue_depth = 10;  // depth of the server's queue; 0: no limit
    std::uint64_t identity = 0;      // the number of the caller's account
  };
  // Why a call does not begin.
  enum class Obstacle : std::uint8_t {
    kPlaces,  // as many calls as its identity may have are without an answer
    kQueue    // the server's queue may be full
  };
  struct Wait {
    TimePoint since;  // when the first of the calls that wait now began to
    Obstacle obstacle = Obstacle::kPlaces;
  };

  // `results`: calls for results of actions.
  explicit CallGate(bool results);

  // ---- the server and callers
  // The server is gone: requests in its queue are lost, and no call begins any more.
  void server_gone();
  // Adds a caller, or changes the terms of a known one.
  void admit(LinkId caller, const Terms& terms);
  // All calls of the caller leave.
  void dismiss(LinkId caller);

  // ---- calls
  // Adds a new call, which waits. Numbers rise per caller.
  void add(LinkId caller, CallId call);
  // A worker prepares the call that next() returned. Room in the server's queue is reserved for it.
  void preparing(LinkId caller, CallId call);
  // The server has received the call that next() returned.
  void handed_over(LinkId caller, CallId call, InvocationId request, TimePoint now);
  // The server has answered, whether anybody still waits or not. leave() is a separate call.
  void answered(InvocationId request, TimePoint now) { queue_.answered(request, now); }
  // The server never received the request, or its answer cannot be used.
  void failed(InvocationId request) { queue_.failed(request); }
  // The call was answered or given up, in any state: its place becomes free.
  void leave(LinkId caller, CallId call);

  // ---- what is next
  [[nodiscard]] std::optional<Next> next(TimePoint now);
  // The time when a silent server is presumed to have room again for waiting calls. Valid after
  // next() has returned nothing.
  [[nodiscard]] std::optional<TimePoint> deadline() const {
    return turns_.empty() ? std::nullopt : queue_.deadline();
  }

  // Calls wait, and none has begun since. Valid after next() has returned nothing.
  [[nodiscard]] const std::optional<Wait>& wait() const { return wait_; }

  // ---- what there is
  // A further call would have to wait for a place.
  [[nodiscard]] bool would_wait(LinkId caller) const;
  // Number of calls that have not begun.
  [[nodiscard]] std::size_t waiting(LinkId caller) const;

 private:
  struct Caller {
    Terms terms;
    std::set<CallId> waiting;
    CallId preparing;         // at most one, so that the order is kept
    std::uint32_t taken = 0;  // places in use
    bool in_turns = false;
  };
  struct Group {
    std::uint32_t taken = 0;  // places in use by all links of the identity
    std::set<LinkId> members;
    std::deque<LinkId> turns;  // members whose next call may begin when there is room
  };

  [[nodiscard]] Caller* find(LinkId caller);
  [[nodiscard]] bool has_place(const Caller& caller) const;
  // Gives a caller whose next call may begin a turn, behind the turns that exist.
  void line_up(LinkId id, Caller& caller);
  // A place of the identity is free.
  void line_up_all(const Group& group);
  void quit(LinkId id, Caller& caller);
  void note_wait(TimePoint now);
  void end_preparing(Caller& caller);

  bool results_;
  bool gone_ = false;
  ServerQueue queue_;
  std::uint32_t preparing_ = 0;  // calls of all callers with reserved room in the queue
  std::map<LinkId, Caller> callers_;
  std::map<std::uint64_t, Group> groups_;  // by identity
  std::deque<std::uint64_t> turns_;        // identities with members in turns
  std::optional<Wait> wait_;
};

}  // namespace connect_bridge
