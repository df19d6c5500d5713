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
  // Passes the services whose servers need ids to the graph. Call it when the loop wakes.
  void watch_servers();
  // Call it when the graph has changed, or the time of Shared::look_again has passed. Reports
  // callers that have left, and lines up the clients and mirrors for a look.
  void look_at_graph(bool changed);
  // Looks at some of them, and reports clients whose server has come or gone. True if more wait.
  bool look_at_some();
  // Requests and invocations that wait for an answer.
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
  std::deque<ServiceClientId> line_;  // clients that wait for a look
  std::set<ServiceClientId> in_line_;
  Duration spent_{};                        // time of all looks since the line was empty
  ServerSight::Time all_due_{};             // when clients with a server may be looked at again
  std::deque<ServiceMirrorId> uncompared_;  // mirrors whose clients wait for a comparison
  bool to_compare_ = false;                 // the graph has changed since uncompared_ was filled
  Duration comparing_{};                    // time spent on uncompared_
  ServerSight::Time compare_due_{};         // when uncompared_ may be filled again
  bool unwatched_ = false;                  // clients came or went since watch_servers()
  ServerSight::Time changed_{};             // last change of the graph, or of our clients
};

}  // namespace connect_bridge::ros
