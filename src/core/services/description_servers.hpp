// The get_type_description services of the nodes under which peers' topics and services exist here.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"
#include "core/types/peer_types.hpp"

namespace connect_bridge {

// A node has one while it has something whose type is not installed here, and then our own node has
// one, too: a caller with the installed package needs no description, and each costs two endpoints.
// None where the graph has that service otherwise. Single-threaded; owned by ServiceImports.
class DescriptionServers {
 public:
  static constexpr std::size_t kServersMax = 256;

  DescriptionServers(const std::string& own_node, Outputs& outputs, PeerTypes& types)
      : own_node_(own_node), outputs_(outputs), types_(types) {}

  // `exists`: whether the graph, or a mirror, has this service. `alone`: no other bridge is in the
  // graph, which may have nodes of the same names; else only our own node has the service.
  void update(const std::function<bool(const std::string& service)>& exists, bool alone);
  // False: it is not of one of these.
  [[nodiscard]] bool on_request(const RequestTaken& request, const Now& now);
  void on_callers_gone(const CallersGone& gone) { types_.calls().on_callers_gone(gone); }
  [[nodiscard]] bool on_failed(const ServiceMirrorFailed& failed);

 private:
  struct Server {
    ServiceMirrorId id;  // none: it exists otherwise, or cannot be made
    bool failed = false;
  };

  [[nodiscard]] std::string service_of(const std::string& node) const;
  void end(Server& server);

  const std::string& own_node_;
  Outputs& outputs_;
  PeerTypes& types_;
  std::map<std::string, Server> servers_;  // by node; empty: our own
};

}  // namespace connect_bridge
