// The services of the fake ROS middleware: servers and clients that find each other by name and
// type. As in DDS a request reaches every server that its client has found, and every one of them
// may answer.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/ports/ports.hpp"
#include "sim/middleware.hpp"
#include "sim/rng.hpp"
#include "sim/roster.hpp"
#include "sim/schedule.hpp"
#include "sim/types.hpp"

namespace connect_bridge::sim {

// A service server, or a mirror of one.
struct Servant {
  EndpointSpec spec;  // its topic is the service
  int id = 0;
  Gid gid;
  bool alive = true;
  TimePoint created{}, destroyed{};
};

// A service client: an ordinary caller, or a bridge that calls for a peer.
struct Caller {
  EndpointSpec spec;
  int id = 0;
  Gid gid;
  bool alive = true;
  TimePoint destroyed{};
  std::vector<int> servants;          // that it has found, dead ones among them
  std::map<int, TimePoint> arrivals;  // by servant: of its last request, which none overtakes
};

// Which request of whom; the middleware's header of a request.
struct RequestKey {
  int caller = 0;
  std::uint64_t number = 0;
  auto operator<=>(const RequestKey&) const = default;
};

class Services {
 public:
  class Listener {
   public:
    virtual ~Listener() = default;
    virtual void on_request(const Servant& servant, RequestKey key, const Payload& payload) = 0;
    virtual void on_response(const Caller& caller, const Servant& servant, RequestKey key,
                             const Payload& payload) = 0;
    // Which living servants a caller has found has changed.
    virtual void on_found(const Caller& caller) = 0;
    virtual void on_caller_gone(const Caller& caller) = 0;
    virtual void on_services_change(int graph) = 0;
  };

  Services(Schedule& schedule, Middleware& middleware, Rng rng, Listener& listener)
      : schedule_(schedule), middleware_(middleware), rng_(rng), listener_(listener) {}

  int create_servant(EndpointSpec spec);
  int create_caller(EndpointSpec spec);
  void destroy_servant(int id);
  void destroy_caller(int id);
  // Returns how many servants it is on its way to.
  int call(RequestKey key, const Payload& payload);
  void answer(int servant, RequestKey key, const Payload& payload);

  // Servers and clients that ended before.
  void forget(TimePoint before);

  // The services of a graph as the process `host` sees them: without its own.
  [[nodiscard]] std::vector<ServiceState> snapshot(int graph, int host) const;

  [[nodiscard]] const Servant& servant(int id) const { return servants_[id]; }
  [[nodiscard]] const Caller& caller(int id) const { return callers_[id]; }
  [[nodiscard]] const Roster<Servant>& servants() const { return servants_; }
  [[nodiscard]] const Roster<Caller>& callers() const { return callers_; }
  // Whether a caller has found a servant that lives.
  [[nodiscard]] bool is_ready(int caller) const;
  [[nodiscard]] static std::string hash_of(const std::string& type) { return hash_of_type(type); }

 private:
  void plan_match(const Caller& caller, const Servant& servant);
  void announce(const EndpointSpec& spec);

  Schedule& schedule_;
  Middleware& middleware_;
  Rng rng_;
  Listener& listener_;
  Roster<Servant> servants_;
  Roster<Caller> callers_;
  std::vector<int> living_servants_, living_callers_;
};

}  // namespace connect_bridge::sim
