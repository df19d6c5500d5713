// Requests to the get_type_description services that this side has for its nodes.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/pace.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"
#include "core/types/mismatches.hpp"

namespace connect_bridge {

// Each is answered once: from the installed package, else by what a peer tells, else that the type
// is not known. A text that has not the hash that was asked for is not given. Any process of the
// graph may ask: beyond the limits here the answer is to ask again later, so that no caller keeps
// the loop busy, and none at one server all the places of the others. Single-threaded; owned by
// PeerTypes.
class DescriptionCalls {
 public:
  static constexpr Duration kPatience = std::chrono::seconds(5);
  // At a time, in all and of one server.
  static constexpr std::size_t kCallsMax = 64;
  static constexpr std::size_t kServerCallsMax = 32;
  // At once and then one in a period, in all and of one server.
  static constexpr int kAtOnceMax = 1024;
  static constexpr Duration kPeriod = std::chrono::milliseconds(10);
  static constexpr int kServerAtOnceMax = 256;
  static constexpr Duration kServerPeriod = std::chrono::milliseconds(50);

  explicit DescriptionCalls(Outputs& outputs) : outputs_(outputs) {}

  void begin(const RequestTaken& request, const Now& now);
  // What is not installed here, and may be known to a peer: on_there() is to follow.
  [[nodiscard]] std::optional<Definition> on_looked_up(const TypeLookedUp& found);
  [[nodiscard]] bool waits_for(const Definition& type) const;
  // A peer's description; empty: it will not come.
  void on_there(const Definition& type, const std::string& text);
  // Nobody waits for these any longer.
  void on_callers_gone(const CallersGone& gone);
  void on_server_gone(ServiceMirrorId server);
  void on_time(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;

 private:
  struct Call {
    ServiceMirrorId server;
    RequestId request;
    Definition type;
    bool with_sources = true;
    LookupId lookup;  // none: a peer is asked
    TimePoint until;
  };

  // Counts one more at this server, if that may have one now.
  [[nodiscard]] bool admit(ServiceMirrorId server, const Now& now);
  void answer(const Call& call, const std::string& text);

  Outputs& outputs_;
  Pace pace_{kAtOnceMax, kPeriod};
  std::map<ServiceMirrorId, Pace> paces_;
  std::vector<Call> calls_;  // in the order of `until`
};

}  // namespace connect_bridge
