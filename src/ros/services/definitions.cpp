#include "ros/services/definitions.hpp"

#include <rcl/graph.h>

#include <string_view>

#include "core/wire/text.hpp"
#include "ros/graph/service_reading.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/rcl/graph_queries.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/types/hashed.hpp"
#include "ros/types/type_name.hpp"

namespace connect_bridge::ros {
namespace {

// Makes "std_srvs::srv::dds_::SetBool_Request_" from "std_srvs/srv/SetBool_Request".
std::string name_in_dds(const std::string& type) {
  const auto name = parse_type_name(type);
  return name ? name->package + "::" + name->kind + "::dds_::" + name->name + "_" : "";
}

std::string shown(const rmw_topic_endpoint_info_t& other, const ServicePart& part,
                  const std::string& service, ServiceEnd end) {
  const std::string is = end == ServiceEnd::kServer ? "server " : "client ";
  return service + ": the definition of " + part.type + " here (" + shown_hash(part.hash) +
         ") is not that of its " + is + full_name({other.node_namespace, other.node_name}) + " (" +
         shown_hash(distro::type_hash_of(other)) +
         "): calls of it may fail or hang. This node and this bridge need the same version of the "
         "package";
}

}  // namespace

PartSeen definitions_of(std::span<const rmw_topic_endpoint_info_t> endpoints,
                        const OwnEndpoints& own, const ServicePart& part) {
  PartSeen seen;
  bool unnamed = false;
  const std::string type = name_in_dds(part.type);
  for (const auto& info : endpoints) {
    if (own.contains(distro::gid_of(info.endpoint_gid))) continue;
    const std::string hash = distro::type_hash_of(info);
    const bool differs = !hash.empty() && !part.hash.empty() && hash != part.hash &&
                         hash != nobodys_hash() && info.topic_type == type;
    seen.known = true;
    if (!differs) continue;
    if (std::string_view(info.node_name) == "_NODE_NAME_UNKNOWN_") {
      unnamed = true;
    } else if (seen.other == nullptr) {
      seen.other = &info;
    }
  }
  seen.known = seen.known && !unnamed;
  return seen;
}

bool compare_definitions(Shared& shared, const std::string& service, const ServiceType& type,
                         ServiceEnd end) {
  if (!middleware().tells_servers() || type.request_hash.empty()) return true;
  const bool serves = end == ServiceEnd::kServer;
  const auto look = [&](bool reads, const std::string& topic, const ServicePart& part) {
    const TopicEndpoints found(
        reads ? &rcl_get_subscriptions_info_by_topic : &rcl_get_publishers_info_by_topic,
        shared.node.handle(), topic.c_str(), true);
    const PartSeen seen = definitions_of({found.begin(), found.end()}, shared.node.own(), part);
    if (seen.other != nullptr)
      shared.tell_other_definition(service, type.name, shown(*seen.other, part, service, end));
    return seen.known;
  };
  // The second question is skipped if nobody has an endpoint for requests: most mirrors have no
  // client at all.
  return look(serves, "rq" + service + "Request", {type.name + "_Request", type.request_hash}) &&
         look(!serves, "rr" + service + "Reply", {type.name + "_Response", type.response_hash});
}

}  // namespace connect_bridge::ros
