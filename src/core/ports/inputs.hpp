// The inputs of the core: from the graph, the network, the login, the workers and the operator.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/qos.hpp"
#include "core/policy/policy.hpp"
#include "core/ports/failure.hpp"
#include "core/wire/codec.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {

// ---- ROS graph -> core

struct Endpoint {
  Gid gid;
  std::string node_namespace;  // "/"
  std::string node_name;       // "talker"
  Qos qos;
  bool operator==(const Endpoint&) const = default;
};

// Why nothing of a type can be taken here. `code` as in wire Decline.
struct TypeLack {
  std::string code;
  std::string reason;
  bool operator==(const TypeLack&) const = default;
};

struct TopicState {
  std::string name;  // fully qualified
  std::string type;  // "std_msgs/msg/String"; a topic seen with two types appears twice
  std::string type_hash;
  std::vector<Endpoint> publishers;
  std::vector<Endpoint> subscribers;
  std::optional<TypeLack> lack = {};  // none: a subscription can be made
  bool has_header = false;            // the type is installed and begins with a std_msgs/msg/Header
  bool operator==(const TopicState&) const = default;
};

// A service server; its gid is all zero where the middleware does not provide it.
struct Server {
  Gid gid;
  std::string node_namespace;
  std::string node_name;
  bool operator==(const Server&) const = default;
};

struct ServiceState {
  std::string name;  // fully qualified
  std::string type;  // "std_srvs/srv/SetBool"; a service seen with two types appears twice
  std::vector<Server> servers;        // at least one
  std::optional<TypeLack> lack = {};  // none: a client can be made
  bool operator==(const ServiceState&) const = default;
};

// A service that somebody has a client of and nobody serves.
struct CalledService {
  std::string name;  // fully qualified
  std::string type;
  auto operator<=>(const CalledService&) const = default;
};

// The whole graph, without the endpoints this process made itself. Hidden names are included.
struct GraphChanged {
  std::vector<TopicState> topics;
  std::vector<ServiceState> services = {};  // with a server
  std::vector<CalledService> called = {};   // without one
  bool operator==(const GraphChanged&) const = default;
};

// One serialized sample taken from a subscription (CDR with its 4-byte encapsulation header).
struct MessageTaken {
  SubscriptionId subscription;
  Gid origin;       // publisher; all zero where the middleware does not provide it
  Stamp stamp = 0;  // source time stamp, system clock; 0 where it is not known
  Payload payload;
  std::uint64_t number = 0;  // counts the publisher's samples; 0 where it is not known
};

// Samples were lost or refused in the layers below (QoS event message_lost, or beyond
// message_bytes_max).
struct MessagesLost {
  SubscriptionId subscription;
  std::uint64_t count = 0;
  bool too_large = false;
};

// Creating an entity failed; it does not exist. `code` as in wire Decline.
template <class Id>
struct EntityFailed {
  Id id;
  std::string code;
  std::string reason;
  std::string hash_here = {};  // of the installed type, if that differs from the peer's
};
using SubscriptionFailed = EntityFailed<SubscriptionId>;
using MirrorFailed = EntityFailed<MirrorId>;
using ServiceMirrorFailed = EntityFailed<ServiceMirrorId>;
using ServiceClientFailed = EntityFailed<ServiceClientId>;
// The mirror exists, but the installed type is not that of its origin, or of the peer's service:
// the rules use it nevertheless.
template <class Id>
struct DefinitionDiffers {
  Id id;
  std::string hash_here;  // of the installed type
};
using TypeDiffers = DefinitionDiffers<MirrorId>;
using ServiceTypeDiffers = DefinitionDiffers<ServiceMirrorId>;
// The id of a mirror in the graph. There is no such input where the middleware does not give the
// id.
struct MirrorMade {
  MirrorId mirror;
  Gid gid;
};
// The middleware refused samples of Publish actions.
struct PublishFailed {
  MirrorId mirror;
  std::uint64_t count = 0;
};
// A publisher offers less than one of our subscriptions requests (QoS event), by policy name. For
// mirrors there is no such input: the graph also shows which subscriber requests more than they
// offer.
struct QosIncompatible {
  SubscriptionId subscription;
  std::string topic;
  std::string policy;
};

// A request arrived at a service mirror. Every request ends with SendResponse or DropRequest.
struct RequestTaken {
  ServiceMirrorId mirror;
  RequestId request;  // chosen by the gateway, never 0, not used again while the mirror lives
  Payload payload;    // serialized request
};
// The callers of these requests have left the graph: nobody waits for an answer.
struct CallersGone {
  ServiceMirrorId mirror;
  std::vector<RequestId> requests;
};
// Whether requests of this client reach a real server now. First sent when there is one.
struct ServiceReady {
  ServiceClientId client;
  bool ready = false;
  std::string type_hash;  // of the installed service type, empty where the distribution has none
};
// The first answer to an invocation; the gateway drops later ones of other servers. For a dropped
// invocation it only reports that the server has taken the request.
struct ResponseTaken {
  ServiceClientId client;
  InvocationId invocation;
  Payload payload;  // empty for a dropped invocation
};
// The request could not be sent (its bytes are not a request of this type, or the middleware
// refused it).
struct InvocationFailed {
  ServiceClientId client;
  InvocationId invocation;
  std::string reason;
};

// ---- network, login, workers -> core

// A WebSocket is open (server: accepted; client: the dial succeeded). `peer` is its address, for
// logs.
struct ConnectionOpened {
  ConnectionId connection;
  std::string peer;        // "203.0.113.5:51234"
  std::string address{};   // server: whom limits count; empty: none do
  int share = 1;           // how many times what other addresses may do it may
  std::string customer{};  // server: with whom it takes turns, perhaps of several addresses
  Stamp expires = 0;       // server: when the certificate ends that the peer has shown; 0: never
  Identity server{};       // client: whom the other end has proved to be; without a name: nobody
};
// A dial ended without a connection.
struct DialFailed {
  ConnectionId connection;
  Failure why;
};
// One WebSocket message.
struct PacketReceived {
  ConnectionId connection;
  bool text = false;
  Payload payload;
};
// The connection is gone, for whatever reason; `code` is the peer's close code, if it sent one.
struct ConnectionClosed {
  ConnectionId connection;
  std::optional<std::uint16_t> code;
  std::string reason;
  Cause cause = Cause::kConnectionLost;  // without a code
};
// The machine's addresses or routes have changed. `route`: also that to the server, as far as that
// is known: a connection may be dead without notice, a dial may succeed now.
struct NetworkChanged {
  bool route = true;
};
// The answer to Authenticate, for a connection that logs in or renews its login. Without an
// identity the login is refused; `reason` is for our log only.
struct Authenticated {
  ConnectionId connection;
  std::optional<Identity> identity;
  std::string reason;
  bool judged = true;  // false: the login method did not come to look at it
};
// Server: the present state of credentials that the login method knew before. Links that logged in
// with one that has no identity any more are closed; the others get the rights of their identity.
struct IdentitiesChanged {
  struct Change {
    std::string credential;  // Identity::credential
    std::optional<Identity> identity;
  };
  std::vector<Change> changes;
};
// Client: what it logs in with from now on.
struct CredentialChanged {
  Bytes credential;
  std::string method = {};  // empty: as before
};
// The answer to a job. Compress: nullopt when it does not shrink. Decompress, decode: nullopt when
// malformed.
struct JobDone {
  JobId job;
  std::optional<Payload> result;
};

// ---- operator -> core

struct PolicyChanged {
  Policy policy;
};
// The limits change for links that exist, too.
struct LimitsChanged {
  std::uint64_t bytes_per_second_max = 0;       // LinkOptions::bytes_per_second_max
  std::uint64_t link_bytes_per_second_max = 0;  // OutboxOptions::bytes_per_second_max
  // The time for breaks that begin from now on. At zero nothing resumes any more after the break
  // under way.
  Duration resume_for{};
  std::uint64_t resume_bytes_max = 0;  // of a link that is lost from now on
};
// Once a second: how many bytes of IP packets this process has sent since its start.
struct TrafficCounted {
  std::uint64_t sent_bytes = 0;
};
// Faults here that concern a peer. A link that is not named has none.
struct FindingsMade {
  std::map<LinkId, std::vector<PeerFinding>> of_links;  // local names
};
// Close everything orderly; the actions end with Stopped when all connections have been closed.
struct StopRequested {};
// Nothing but time has passed (a deadline of next_deadline() is reached).
struct TimePassed {};

using Input =
    std::variant<GraphChanged, MessageTaken, MessagesLost, SubscriptionFailed, MirrorMade,
                 MirrorFailed, TypeDiffers, PublishFailed, QosIncompatible, RequestTaken,
                 CallersGone, ServiceReady, ResponseTaken, InvocationFailed, ServiceMirrorFailed,
                 ServiceTypeDiffers, ServiceClientFailed, ConnectionOpened, DialFailed,
                 PacketReceived, ConnectionClosed, NetworkChanged, Authenticated, IdentitiesChanged,
                 CredentialChanged, JobDone, PolicyChanged, LimitsChanged, TrafficCounted,
                 FindingsMade, StopRequested, TimePassed>;

}  // namespace connect_bridge
