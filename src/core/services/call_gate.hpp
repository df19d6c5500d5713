// Decides which call a real server gets next.
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

// The scheduler of the calls that peers make at one service. It knows calls by their ids only; a
// call waits until next() gives it out to be handed over to the server, and takes one of its
// caller's places until it leaves. A caller is a link.
//
// Callers with a call that may begin take turns, one call each time, so that a link with a thousand
// calls holds up no other. The server's queue is short and shared by them: none begins without room
// in it. The calls of one caller begin in the order of their numbers; while one of them is prepared
// (decompressed by a worker), those behind it wait. A call for the result of an action lasts as
// long as its goal does, so such callers have more places.
//
// After every change that may let a call begin, and at the deadline, call next() until it returns
// nothing. Pure: no outputs, no links. Single-threaded.
class CallGate {
 public:
  struct Next {
    LinkId caller;
    CallId call;
  };
  // What a rule grants a caller.
  struct Terms {
    std::uint32_t places = 1;
    std::uint32_t queue_depth = 10;  // of the server's queue; 0: no limit
  };

  // `results`: calls for results of actions.
  explicit CallGate(bool results);

  // ---- the server and callers
  // The server is gone: what was in its queue is lost, and no call begins any more.
  void server_gone();
  // A new caller, or other terms for one that is known.
  void admit(LinkId caller, const Terms& terms);
  // All calls of the caller leave.
  void dismiss(LinkId caller);

  // ---- calls
  // A new call, which waits. Numbers rise per caller.
  void add(LinkId caller, CallId call);
  // The call that next() returned is prepared by a worker; room in the server's queue is reserved
  // for it.
  void preparing(LinkId caller, CallId call);
  // The call that next() returned was handed over to the server.
  void handed_over(LinkId caller, CallId call, InvocationId request, TimePoint now);
  // The server has answered, whether anybody still waits for the answer or not. leave() is called
  // separately.
  void answered(InvocationId request, TimePoint now) { queue_.answered(request, now); }
  // The server never got the request, or its answer cannot be used.
  void failed(InvocationId request) { queue_.failed(request); }
  // The call was answered or given up, in whatever state: its place becomes free.
  void leave(LinkId caller, CallId call);

  // ---- what is next
  [[nodiscard]] std::optional<Next> next(TimePoint now);
  // After next() has returned nothing: when a server that has not answered for long is presumed to
  // have room again for those that wait.
  [[nodiscard]] std::optional<TimePoint> deadline() const {
    return turns_.empty() ? std::nullopt : queue_.deadline();
  }

  // ---- what there is
  // Whether a further call would have to wait for a place.
  [[nodiscard]] bool would_wait(LinkId caller) const;
  // Calls that have not begun.
  [[nodiscard]] std::size_t waiting(LinkId caller) const;

 private:
  struct Caller {
    Terms terms;
    std::set<CallId> waiting;
    CallId preparing;         // one at most, so that order is kept
    std::uint32_t taken = 0;  // places
    bool in_turns = false;
  };

  [[nodiscard]] Caller* find(LinkId caller);
  [[nodiscard]] bool has_place(const Caller& caller) const;
  // It may have a call that may begin now: it has its turn behind those that had one before.
  void line_up(LinkId id, Caller& caller);
  void end_preparing(Caller& caller);

  bool results_;
  bool gone_ = false;
  ServerQueue queue_;
  std::uint32_t preparing_ = 0;  // of all callers: they have room in the queue
  std::map<LinkId, Caller> callers_;
  std::deque<LinkId> turns_;  // of callers whose next call may begin when there is room
};

}  // namespace connect_bridge
