// Decides which call a real server gets next, by the places of a link, the places of a caller, and
// the room in the server's queue.
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

// The scheduler of the calls that peers make here. It knows calls by their ids only; a call is
//
//   waiting      for a place;
//   placed       it has one, and waits for room in the server's queue;
//   handed over  it was given out by next(), and keeps its place until it leaves.
//
// Fairness. A call takes two places: one of its link, shared by all services of that link, and one
// of its caller (a link at a service), so that a service which never answers leaves places of the
// link for the others. The first call of a caller takes none of its link: however many services
// answer nothing, each other one can be called. The services of a link take turns at its places,
// one call each time. A server's queue is short and shared by all links: a caller has one placed
// call at a time, and placed calls are handed over in the order in which they were placed, so links
// take turns at the server, however many calls each of them has. The calls of one caller are handed
// over in the order of their numbers; while one of them is prepared (decompressed by a worker),
// those behind it wait. A call for the result of an action lasts as long as its goal does, so it
// takes no place of its link, and such callers have a limit of their own.
//
// After every change that may let a call begin, call next() until it returns nothing. Pure: no
// outputs, no links. Single-threaded.
class CallGate {
 public:
  // One link at one service; the service is identified by its client.
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

  explicit CallGate(std::uint32_t link_places) : link_places_(link_places) {}
  CallGate(const CallGate&) = delete;
  CallGate& operator=(const CallGate&) = delete;

  // ---- links and callers
  // `results`: calls for results of actions.
  void open(ServiceClientId service, bool results);
  // The server is gone: what was in its queue is lost, and no placed call is handed over to it.
  void server_gone(ServiceClientId service);
  // After its callers are.
  void close(ServiceClientId service);
  // A new caller, or other terms for one that is known.
  void admit(const Caller& caller, const Terms& terms);
  // All calls of the caller leave.
  void dismiss(const Caller& caller);
  // The link is dead and its callers will be dismissed: its free places are not given out any more.
  void close(LinkId link);
  void forget(LinkId link);

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
  // The call was answered or given up, in whatever state: its places become free.
  void leave(const Caller& caller, CallId call);

  // ---- what is next
  // The caller may have free places because its terms have changed.
  void consider(const Caller& caller);
  // Between hold() and release() next() returns nothing.
  void hold() { held_ = true; }
  void release() { held_ = false; }
  [[nodiscard]] std::optional<Next> next(TimePoint now);
  // Servers that have not answered for long are presumed to have room again.
  void expire(TimePoint now);
  [[nodiscard]] std::optional<TimePoint> deadline() const { return timers_.deadline(); }

  // ---- what there is
  // Whether a further call would have to wait for a place.
  [[nodiscard]] bool would_wait(const Caller& caller);
  [[nodiscard]] std::size_t waiting(LinkId link) const;
  // Waiting or placed.
  [[nodiscard]] std::size_t waiting(const Caller& caller) const;

 private:
  struct Service {
    explicit Service(bool is_results);

    bool results = false;
    ServerQueue queue;
    std::uint32_t preparing = 0;  // of all callers: they have room in the queue
    std::deque<Caller> placed;    // callers with a placed call, in turn
    Timers<ServiceClientId>::Timer timer;
  };
  struct LinkPlaces {
    std::uint32_t taken = 0;  // without those for results, and the first of each service
    std::size_t waiting = 0;
    std::deque<ServiceClientId> turns;  // services whose calls wait for a place of the link
    bool closed = false;
  };
  struct CallerState {
    Terms terms;
    std::set<CallId> waiting;
    CallId placed;     // one at most, so that links take turns
    CallId preparing;  // one at most, so that order is kept
    std::uint32_t taken = 0;
    bool in_turns = false;  // of its link
  };
  struct Found {  // a caller with its service and link
    const Caller& caller;
    CallerState& state;
    Service& service;
    LinkPlaces& link;
  };

  [[nodiscard]] std::optional<Found> find(const Caller& caller);
  [[nodiscard]] static bool has_place(const CallerState& state, const Service& service);
  // Whether its next call takes no place of the link: it is for a result, or the only one.
  [[nodiscard]] static bool passes_link(const Found& at);
  [[nodiscard]] static bool has_room(const CallerState& state, Service& service, TimePoint now);
  // Each returns the next call to hand over, if there is one.
  std::optional<Next> let_in(ServiceClientId service, TimePoint now);
  std::optional<Next> share_places(Caller caller, TimePoint now);
  std::optional<Next> take_place(const Found& at, TimePoint now);
  static void line_up(const Found& at);
  static void free_place(const Found& at);
  void watch(ServiceClientId id, Service& service);
  void mark(const Caller& caller);

  std::uint32_t link_places_;
  Timers<ServiceClientId> timers_;  // of queues where callers wait for room
  std::map<ServiceClientId, Service> services_;
  std::map<LinkId, LinkPlaces> links_;
  std::map<Caller, CallerState> callers_;
  // Where a server's queue may have room again and, if a link is set, that link free places.
  std::deque<Caller> due_;
  std::optional<Caller> sharing_;  // the caller whose link's places are being given out
  bool held_ = false;
};

}  // namespace connect_bridge
