// Checks service calls, from the caller to the server and back: each is answered at most once, to
// its caller, with the bytes that a server gave for it; no server executes it twice; and none is
// kept that has no owner any more.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sim/label.hpp"
#include "sim/ledger.hpp"
#include "sim/services.hpp"

namespace connect_bridge::sim {

// The first label of requests and responses, so that no sample is mistaken for one.
inline constexpr std::uint32_t kCallerLabels = 1U << 28;
inline constexpr std::uint32_t kServantLabels = 1U << 29;

class CallCheck {
 public:
  explicit CallCheck(const Ledger& ledger) : ledger_(ledger) {}

  // ---- what ordinary nodes do. A call's label is that of its request.
  void on_call(int caller) { ++called_[caller]; }
  // Returns the label of the response, should the servant ever answer.
  Label on_executed(const Services& services, const Servant& servant, RequestKey key,
                    const Payload& request);
  void on_answered(const Servant& servant, const Label& response, const Payload& payload);
  void on_response(const Caller& caller, const Servant& servant, RequestKey key,
                   const Payload& payload);
  // A request is dropped from a server's full queue. `shared`: others call or serve there, too,
  // which a bridge cannot know.
  void on_lost(const Caller& caller, const Servant& servant, RequestKey key, bool shared);
  // One bridge alone has filled a server's queue.
  void on_full_queue(const Caller& caller) {
    if (caller.spec.host >= 0) ledger_.coverage().count(Judged::kFullQueues);
  }

  // ---- what happens at the importing side
  void on_taken(const Host& host, ServiceMirrorId mirror, RequestId request, const Caller& caller,
                const Payload& payload);
  void on_send_response(const Host& host, const SendResponse& action, const EndpointSpec& mirror);
  void on_request_dropped(const Host& host, const DropRequest& action);
  void on_callers_gone(const Host& host, const CallersGone& input);
  void on_mirror_gone(const Host& host, ServiceMirrorId mirror);
  // Called from time to time: no call is open for longer than its rule says.
  void inspect(const Host& host) const;

  // ---- what happens at the exporting side
  void on_send_request(const Host& host, const SendRequest& action, const Caller& client);
  void on_invocation_over(const Host& host, ServiceClientId client, InvocationId invocation);
  void on_client_gone(const Host& host, ServiceClientId client);
  void on_end(const Host& host);

  [[nodiscard]] bool is_open(const Host& host, ServiceClientId client, InvocationId which) const;
  // Requests that wait for an answer at a mirror, by the callers' ids.
  [[nodiscard]] std::vector<RequestId> open_requests_of(const Host& host, ServiceMirrorId mirror,
                                                        int caller) const;

  // ---- judged when all is quiet
  // How often a caller has got an answer to its n-th call.
  [[nodiscard]] int answers(int caller, std::uint32_t number) const;
  [[nodiscard]] int executions(int caller, std::uint32_t number) const;
  // Every call under way has an owner: a servant that still works on it.
  void check_nothing_pending(const Services& services) const;
  // Whether calls wait for servers that have ended, or have lost them.
  [[nodiscard]] bool has_lost(const Services& services) const;
  [[nodiscard]] std::uint32_t called(int caller) const;
  [[nodiscard]] std::uint64_t executed() const { return executed_; }
  // Calls that were made before; none of them may still be under way.
  void forget(const Services& services, TimePoint before);

 private:
  struct CallKey {
    int caller = 0;
    std::uint64_t number = 0;
    auto operator<=>(const CallKey&) const = default;
  };
  struct Call {
    int takings = 0;             // at mirrors, from the caller itself
    std::map<int, int> relayed;  // servant -> executions on behalf of a bridge
    std::map<int, int> direct;   // servant -> executions for the caller itself
    int answers = 0;
    TimePoint last{};  // when it was last taken or executed
  };
  struct Execution {
    CallKey call;
    int servant = 0;
    std::size_t bytes = 0;      // of the response, 0: none yet
    std::uint64_t answers = 0;  // how often its servant has answered
    TimePoint at{};
  };
  struct OpenRequest {
    CallKey call;
    int caller = 0;  // who sent it: the call's caller, or a bridge
    TimePoint taken{};
  };
  struct TopicMirror {
    std::map<RequestId, OpenRequest> open;
    std::set<RequestId> gone;  // their callers are; the side has still to drop them
    RequestId last;
  };
  struct Invocation {
    TimePoint sent{};
    CallKey call;
    std::vector<int> servants;  // that it was on its way to
    std::set<int> lost;         // those in whose queues there was no room
  };
  struct Client {
    std::map<InvocationId, Invocation> open;
    InvocationId last;
  };
  [[nodiscard]] const Execution& execution_of(const Label& response) const;
  [[nodiscard]] CallKey call_of(const Payload& request, const std::string& where) const;
  // Whether its servers have lost it, or have ended in a way that nobody could notice.
  [[nodiscard]] bool is_lost(const Services& services, const Invocation& invocation) const;
  void check_caps(const Host& host, const EndpointSpec& spec, const Client& client) const;
  // How a host treats a service, by the rule with the highest limits for its peers.
  [[nodiscard]] Treatment limits_of(const Host& host, Direction direction, const std::string& name,
                                    const std::string& type) const;

  const Ledger& ledger_;
  std::map<int, std::uint32_t> called_;
  std::map<CallKey, Call> calls_;
  std::map<std::uint64_t, Execution> executions_;  // by their number
  std::uint64_t executed_ = 0;
  std::map<std::pair<int, ServiceMirrorId>, TopicMirror> mirrors_;  // by host
  std::map<std::pair<int, ServiceClientId>, Client> clients_;       // by host
};

}  // namespace connect_bridge::sim
