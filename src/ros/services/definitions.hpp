// Whether other nodes have another definition of a service's type than the installed one. The graph
// of DDS middlewares shows the hashes of a service's requests and responses, not the service's own.
#pragma once

#include <rmw/topic_endpoint_info.h>

#include <span>
#include <string>

#include "ros/entities/shared.hpp"
#include "ros/node/own_endpoints.hpp"
#include "ros/types/service_type.hpp"

namespace connect_bridge::ros {

// The requests or the responses of a service.
struct ServicePart {
  std::string type;  // "std_srvs/srv/SetBool_Request"
  std::string hash;  // hash of the installed definition
};

// Result of a look at the endpoints of one part.
struct PartSeen {
  bool known = false;  // others have endpoints, and none of them waits for a name
  const rmw_topic_endpoint_info_t* other = nullptr;  // the first one with another definition
};
// Looks at the endpoints of others. Endpoints without hashes (before Iron, or without ROS) count as
// having the same definition. `known` stays false until a node with another definition has a name.
[[nodiscard]] PartSeen definitions_of(std::span<const rmw_topic_endpoint_info_t> endpoints,
                                      const OwnEndpoints& own, const ServicePart& part);

enum class ServiceEnd { kServer, kClient };

// Logs, once per service and type, if a server or a client of others has another definition;
// `service` is the full name. False: not all of them are known yet, or there are none. Asks the
// graph at most twice, and never if it shows no hashes. Thread: the loop's.
bool compare_definitions(Shared& shared, const std::string& service, const ServiceType& type,
                         ServiceEnd end);

}  // namespace connect_bridge::ros
