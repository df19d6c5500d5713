// Whether other nodes have another definition of a service's type than the installed one. Of DDS
// middlewares the graph shows the hashes of a service's requests and responses, not its own.
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
  std::string hash;  // of the installed definition
};

// What endpoints of one part show.
struct PartSeen {
  bool known = false;  // others have endpoints, and there is nothing to wait for
  const rmw_topic_endpoint_info_t* other = nullptr;  // the first one with another definition
};
// Endpoints without hashes (before Iron, or without ROS) have no other definition, as far as is
// known. The name of a node with another one is waited for.
[[nodiscard]] PartSeen definitions_of(std::span<const rmw_topic_endpoint_info_t> endpoints,
                                      const OwnEndpoints& own, const ServicePart& part);

enum class ServiceEnd { kServer, kClient };

// Logs, once per service and type, if a server or a client of others has another definition; the
// service has its full name. False: they are not all known yet, or there are none. Two questions to
// the graph at most, and none where it shows no hashes. Thread: the loop's.
bool compare_definitions(Shared& shared, const std::string& service, const ServiceType& type,
                         ServiceEnd end);

}  // namespace connect_bridge::ros
