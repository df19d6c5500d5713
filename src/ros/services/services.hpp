// The service servers and clients of the gateway.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>

#include "core/ports/ports.hpp"
#include "ros/entities/ready_list.hpp"
#include "ros/node/node.hpp"
#include "ros/node/proxy_nodes.hpp"
#include "ros/services/service_client.hpp"
#include "ros/services/service_mirror.hpp"
#include "ros/topics/subscription.hpp"
#include "ros/types/type_supports.hpp"

namespace connect_bridge::ros {

// What the parts of the gateway share.
struct ServicePorts {
  Node& node;
  TypeSupports& types;
  ReadyList& ready;
  ProxyNodes& proxies;
  TakeBuffer& buffer;
  std::uint32_t message_bytes_max = 0;
  std::function<void(Input)> report;  // for later: an input that is no answer to a step
  std::function<void(std::set<std::string>)> watch;  // the services that our clients call
  std::function<void(Duration)> look_again;          // look_at_graph() is wanted after this time
};

struct ServiceCounters {
  std::uint64_t requests = 0;   // taken at mirrors
  std::uint64_t responses = 0;  // taken at clients
  std::uint64_t refused = 0;    // bytes that were no message, or too large
};

// Thread: the loop's.
class Services {
 public:
  // The kinds of slots that step_mirror() and step_client() are for.
  Services(ServicePorts ports, std::uint32_t mirror_kind, std::uint32_t client_kind);
  Services(const Services&) = delete;
  Services& operator=(const Services&) = delete;

  void apply(const CreateServiceMirror& action);
  void apply(const DestroyServiceMirror& action);
  void apply(const SendResponse& action);
  void apply(const DropRequest& action);
  void apply(const CreateServiceClient& action);
  void apply(const DestroyServiceClient& action);
  void apply(const SendRequest& action);
  void apply(const DropInvocation& action);
  void clear();

  // One take for the owner of this slot; clears its bit when that was all. `bytes` grows by what
  // was taken.
  std::optional<Input> step_mirror(ReadyList::Slot& slot, std::size_t& bytes);
  std::optional<Input> step_client(ReadyList::Slot& slot, std::size_t& bytes);

  // The graph has changed, or the time given to look_again has passed: reports which clients have a
  // server, and which callers have left.
  void look_at_graph(bool changed);

  [[nodiscard]] const ServiceCounters& counters() const { return counters_; }
  [[nodiscard]] std::size_t mirrors() const { return mirrors_.size(); }
  [[nodiscard]] std::size_t clients() const { return clients_.size(); }
  // Requests and invocations that are kept for an answer.
  [[nodiscard]] std::size_t pending() const;

 private:
  // Counts it, and logs it now and then.
  void refused(const std::string& what);
  void watch_services();
  void look_for_servers();
  void look_for_callers(bool changed);
  void tell_ready(ServiceClient& client, bool ready);
  [[nodiscard]] std::size_t memory_max() const;

  ServicePorts ports_;
  const std::uint32_t mirror_kind_;
  const std::uint32_t client_kind_;
  std::unordered_map<ServiceMirrorId, std::unique_ptr<ServiceMirror>> mirrors_;
  std::unordered_map<ServiceClientId, std::unique_ptr<ServiceClient>> clients_;
  ServiceCounters counters_;
  std::chrono::steady_clock::time_point changed_{};  // the graph, or our clients
};

}  // namespace connect_bridge::ros
