// The service servers and clients of the gateway, and their callers and servers in the graph.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <set>

#include "ros/entities/entities.hpp"
#include "ros/graph/graph_watcher.hpp"
#include "ros/services/service_client.hpp"
#include "ros/services/service_mirror.hpp"

namespace connect_bridge::ros {

// Thread: the loop's.
class Services {
 public:
  Services(Shared& shared, GraphWatcher& graph)
      : mirrors(shared), clients(shared), shared_(shared), graph_(graph) {}
  Services(const Services&) = delete;
  Services& operator=(const Services&) = delete;

  void create_client(const CreateServiceClient& action);
  void destroy_client(ServiceClientId id);
  // Tells the graph whose servers are to be known. To be called when the loop wakes.
  void watch_servers();
  // The graph has changed, or the time given to Shared::look_again has passed: reports which
  // callers have left, and lines up the clients and mirrors that are to be looked at.
  void look_at_graph(bool changed);
  // Looks at some of these, and reports which clients have a server. Returns whether more wait.
  bool look_at_some();
  // Requests and invocations that are kept for an answer.
  [[nodiscard]] std::size_t pending() const;

  Entities<ServiceMirror> mirrors;
  Entities<ServiceClient> clients;  // created and destroyed by the functions above

 private:
  void line_up(bool all);
  void line_up_mirrors(bool changed);
  bool compare_some();
  void look_for_callers(bool changed);

  Shared& shared_;
  GraphWatcher& graph_;
  std::deque<ServiceClientId> line_;  // clients that are to be looked at
  std::set<ServiceClientId> in_line_;
  Duration spent_{};             // on those that have been looked at, since the line was empty
  ServerSight::Time all_due_{};  // when those that have their server may be looked at again
  std::deque<ServiceMirrorId> uncompared_;  // mirrors whose clients' definitions are to be compared
  bool to_compare_ = false;                 // the graph has changed since these were lined up
  Duration comparing_{};                    // time spent on these
  ServerSight::Time compare_due_{};         // when they may be lined up again
  bool unwatched_ = false;                  // clients came or went since watch_servers()
  ServerSight::Time changed_{};             // the graph, or our clients
};

}  // namespace connect_bridge::ros
