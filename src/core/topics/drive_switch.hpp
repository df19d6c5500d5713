// The service ~/drive of an operator's side: its caller takes or leaves the wheels of all topics
// that this side steers. docs/driving.md section "The wheel".
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/graph/claims.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"
#include "core/topics/local_topics.hpp"

namespace connect_bridge {

// A call is answered when the robots have told that the wheels are as wanted, or after kAnswerMax.
// Single-threaded; owned by the side.
class DriveSwitch {
 public:
  // `node`: our own, whose service it is; empty: there is no service.
  DriveSwitch(const std::string& node, Outputs& outputs);

  // Makes the service, once. Called after a claim has named it: other bridges do not export it.
  void appear();
  void add_mirrored(Claim& claim) const;
  // False: the input concerns another service.
  [[nodiscard]] bool on_request(const RequestTaken& request, LocalTopics& topics, const Now& now);
  [[nodiscard]] bool on_failed(const ServiceMirrorFailed& failed);
  // Robots have told who steers, or time has passed.
  void answer(LocalTopics& topics, const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;

 private:
  struct Call {
    RequestId request;
    WheelWant want = WheelWant::kTake;
    TimePoint until;
  };

  const std::string name_;
  Outputs& outputs_;
  ServiceMirrorId service_;
  std::deque<Call> calls_;  // in the order of their times
};

}  // namespace connect_bridge
