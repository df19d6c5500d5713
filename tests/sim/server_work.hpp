// How the ordinary servers work: requests lie in a queue of ROS 2's default depth until they are
// taken, one by one or by several threads, and sometimes it is not read for seconds.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>

#include "sim/call_check.hpp"
#include "sim/rng.hpp"
#include "sim/scenario.hpp"
#include "sim/services.hpp"

namespace connect_bridge::sim {

class ServerWork {
 public:
  ServerWork(Schedule& schedule, Services& services, CallCheck& check, Rng rng)
      : schedule_(schedule), services_(services), check_(check), rng_(rng) {}

  void add(int servant, const ServicePlan& plan) { desks_[servant].plan = &plan; }
  void on_request(const Servant& servant, RequestKey key, const Payload& payload);
  // From now on servers take and answer at once; also what they had put off for ever.
  void calm();
  // Servers that the middleware is about to forget, and what they had put off.
  void forget(TimePoint before);
  // How long they work when it is calm.
  void take_time(Duration calm_work) { calm_work_ = calm_work; }

 private:
  struct Request {
    RequestKey key;
    Payload payload;
  };
  struct Desk {
    const ServicePlan* plan = nullptr;
    std::deque<Request> queue;  // the newest kServerDepth, as DDS keeps them
    bool working = false;       // the only thread does
    bool rested = true;         // the queue was empty since it was last left alone
    TimePoint away_until{};
    std::map<int, TimePoint> left;  // by caller: when a request of it was last taken or lost
  };
  struct Answer {
    int servant = 0;
    RequestKey key;
    Label label;
    std::size_t bytes = 0;
    TimePoint taken{};
  };
  void look(int servant);
  void take(int servant, Desk& desk);
  void lose_oldest(const Servant& servant, Desk& desk);
  // Whether others call there, too.
  [[nodiscard]] bool is_shared(const Desk& desk, int caller) const;
  // Whether others serve there, too: then an exporter uses the first answer of any of them.
  [[nodiscard]] bool has_double(const Servant& servant) const;
  void give(std::uint64_t work);

  Schedule& schedule_;
  Services& services_;
  CallCheck& check_;
  Rng rng_;
  bool calm_ = false;
  Duration calm_work_ = std::chrono::milliseconds(1);
  std::map<int, Desk> desks_;  // by servant
  // Calls without an answer, by their number: put off for ever, or until it is calm, among them.
  std::map<std::uint64_t, Answer> working_;
  std::uint64_t last_work_ = 0;
};

}  // namespace connect_bridge::sim
