// Decides which call a real server gets next.
#pragma once

#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/base/timers.hpp"
#include "core/services/server_queue.hpp"

namespace connect_bridge {

// The scheduler of the calls that peers make here. It knows calls by their ids only; a call waits
// until next() gives it out to be handed over to its server, and takes one of its caller's places
// until it leaves. A caller is a link at a service.
//
// For each service by itself: callers with a call that may begin take turns, one call each time, so
// that a link with a thousand calls holds up no other. The server's queue is short and shared by
// them: none begins without room in it. The calls of one caller begin in the order of their
// numbers; while one of them is prepared (decompressed by a worker), those behind it wait. A call
// for the result of an action lasts as long as its goal does, so such callers have more places.
//
// After every change that may let a call begin, call next() until it returns nothing. Pure: no
// outputs, no links. Single-threaded.
class CallGate {
 public:
  // The service is identified by its client.
  struct Caller {
    LinkId link;
    ServiceClientId service;
    auto operator<=>(const Caller&) const = default;
  };
  struct Next {
    Caller caller;
    CallId call;
  };
  // What a rule grants a caller at a service.
  struct Terms {
    std::uint32_t places = 1;
    std::uint32_t queue_depth = 10;  // of the server's queue; 0: no limit
  };

  CallGate() = default;
  CallGate(const CallGate&) = delete;
  CallGate& operator=(const CallGate&) = delete;

  // ---- services and callers
  // `results`: calls for results of actions.
  void open(ServiceClientId service, bool results);
  // The server is gone: what was in its queue is lost, and no call begins there any more.
  void server_gone(ServiceClientId service);
  // After its callers are.
  void close(ServiceClientId service);
  // A new caller, or other terms for one that is known.
  void admit(const Caller& caller, const Terms& terms);
  // All calls of the caller leave.
  void dismiss(const Caller& caller);

  // ---- calls
  // A new call, which waits. Numbers rise per caller.
  void add(const Caller& caller, CallId call);
  // The call that next() returned is prepared by a worker; room in the server's queue is reserved
  // for it.
  void preparing(const Caller& caller, CallId call);
  // The call that next() returned was handed over to the server.
  void handed_over(const Caller& caller, CallId call, InvocationId request, TimePoint now);
  // The server has answered, whether anybody still waits for the answer or not. leave() is called
  // separately.
  void answered(ServiceClientId service, InvocationId request, TimePoint now);
  // The server never got the request, or its answer cannot be used.
  void failed(ServiceClientId service, InvocationId request);
  // The call was answered or given up, in whatever state: its place becomes free.
  void leave(const Caller& caller, CallId call);

  // ---- what is next
  // Between hold() and release() next() returns nothing.
  void hold() { held_ = true; }
  void release() { held_ = false; }
  [[nodiscard]] std::optional<Next> next(TimePoint now);
  // Servers that have not answered for long are presumed to have room again.
  void expire(TimePoint now);
  [[nodiscard]] std::optional<TimePoint> deadline() const { return timers_.deadline(); }

  // ---- what there is
  // Whether a further call would have to wait for a place.
  [[nodiscard]] bool would_wait(const Caller& caller) const;
  // Calls that have not begun.
  [[nodiscard]] std::size_t waiting(const Caller& caller) const;

 private:
  struct CallerState {
    Terms terms;
    std::set<CallId> waiting;
    CallId preparing;         // one at most, so that order is kept
    std::uint32_t taken = 0;  // places
    bool in_turns = false;
  };
  struct Service {
    explicit Service(bool is_results);

    bool results = false;
    bool gone = false;
    ServerQueue queue;
    std::uint32_t preparing = 0;  // of all callers: they have room in the queue
    std::map<LinkId, CallerState> callers;
    std::deque<LinkId> turns;  // of callers whose next call may begin when there is room
    Timers<ServiceClientId>::Timer timer;
  };

  [[nodiscard]] Service* find(ServiceClientId service);
  [[nodiscard]] CallerState* find(const Caller& caller);
  [[nodiscard]] static bool has_place(const Service& service, const CallerState& caller);
  // It may have a call that may begin now: it has its turn behind those that had one before.
  void line_up(const Caller& caller);
  [[nodiscard]] std::optional<Next> next_of(ServiceClientId id, TimePoint now);
  void watch(ServiceClientId id, Service& service);

  Timers<ServiceClientId> timers_;  // of queues where callers wait for room
  std::map<ServiceClientId, Service> services_;
  std::set<ServiceClientId> due_;  // where a call may begin
  bool held_ = false;
};

}  // namespace connect_bridge
