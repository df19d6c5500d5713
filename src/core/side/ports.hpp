// The values that cross the border of the core: inputs in, actions out. They can be recorded and
// replayed.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/close_code.hpp"
#include "core/base/ids.hpp"
#include "core/base/qos.hpp"
#include "core/policy/policy.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge {

// ---- ROS graph -> core --------------------------------------------------------------------------

struct Endpoint {
  Gid gid;
  std::string node_namespace;  // "/"
  std::string node_name;       // "talker"
  Qos qos;
};

struct TopicState {
  std::string name;  // fully qualified
  std::string type;  // "std_msgs/msg/String"; a topic seen with two types appears twice
  std::string type_hash;
  std::vector<Endpoint> publishers;
  std::vector<Endpoint> subscribers;
};

// The whole graph, without the endpoints this process made itself. Hidden topics are included.
struct GraphChanged {
  std::vector<TopicState> topics;
};

// One serialized sample taken from a subscription (CDR with its 4-byte encapsulation header).
struct MessageTaken {
  SubscriptionId subscription;
  Gid origin;       // publisher; all zero where the middleware does not tell
  Stamp stamp = 0;  // source time stamp, system clock; 0 where the middleware does not tell
  Payload payload;
};

// More samples were lost or refused below us (QoS event message_lost, or beyond message_bytes_max).
struct MessagesLost {
  SubscriptionId subscription;
  std::uint64_t count = 0;
  bool too_large = false;
};

// Creating an entity failed; it does not exist. `code` as in wire Decline.
struct SubscriptionFailed {
  SubscriptionId subscription;
  std::string code;
  std::string reason;
};
struct MirrorFailed {
  MirrorId mirror;
  std::string code;
  std::string reason;
};
// The middleware reports an incompatible pair at one of our endpoints (QoS event), by policy name.
struct QosIncompatible {
  std::string topic;
  std::string policy;
  bool at_mirror = false;  // at a mirror (publisher), else at a subscription
};

// ---- network, login, workers -> core
// --------------------------------------------------------------

// A WebSocket is open (server: accepted; client: the dial succeeded). `peer` is its address, for
// logs.
struct ConnectionOpened {
  ConnectionId connection;
  std::string peer;
};
// A dial ended without a connection.
struct DialFailed {
  ConnectionId connection;
  std::string reason;
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
};
// The answer to Authenticate. Without an identity the login is refused; `reason` is for our log
// only.
struct Authenticated {
  ConnectionId connection;
  std::optional<Identity> identity;
  std::string reason;
};
// The answer to CompressJob or DecompressJob. Compress: nullopt when it does not shrink.
// Decompress: nullopt when malformed.
struct JobDone {
  JobId job;
  std::optional<Payload> result;
};

// ---- operator -> core
// -------------------------------------------------------------------------------

struct PolicyChanged {
  Policy policy;
};
// Close everything orderly; Actions end with Stopped when the connections have been told.
struct StopRequested {};
// Nothing but time has passed (a deadline of next_deadline() is reached).
struct TimePassed {};

using Input =
    std::variant<GraphChanged, MessageTaken, MessagesLost, SubscriptionFailed, MirrorFailed,
                 QosIncompatible, ConnectionOpened, DialFailed, PacketReceived, ConnectionClosed,
                 Authenticated, JobDone, PolicyChanged, StopRequested, TimePassed>;

// ---- core -> ROS
// ---------------------------------------------------------------------------------------

struct CreateSubscription {
  SubscriptionId id;
  std::string topic;
  std::string type;
  std::string type_hash;
  Qos qos;  // depth is always given
};
struct DestroySubscription {
  SubscriptionId id;
};
struct CreateMirror {
  MirrorId id;
  std::string topic;
  std::string type;
  std::string type_hash;
  Qos qos;  // depth is always given
};
struct DestroyMirror {
  MirrorId id;
};
struct Publish {
  MirrorId mirror;
  Payload payload;
};
// Ask for a fresh GraphChanged (a sample came from a publisher not seen yet).
struct RefreshGraph {};

// ---- core -> network, login, workers
// ---------------------------------------------------------------------

// Client only: open a connection to the configured URL under this id.
struct Dial {
  ConnectionId connection;
};
// The peer is known (server: after login; client: after welcome): from now on it may send packets
// of up to packet_bytes_max. Until then the network takes 4096 bytes per packet and 16 KiB in
// total.
struct OpenGate {
  ConnectionId connection;
  std::uint32_t packet_bytes_max = 0;
};
// Send what was handed out, then close with this code; no PacketReceived follows, ConnectionClosed
// does.
struct CloseConnection {
  ConnectionId connection;
  CloseCode code = CloseCode::kNormal;
  std::string reason;  // at most 120 bytes of UTF-8 (RFC 6455: 123)
};
struct Authenticate {
  ConnectionId connection;
  std::string peer;
  std::string method;
  Bytes credential;
};
struct CompressJob {
  JobId job;
  Compression how;
  Payload raw;
};
struct DecompressJob {
  JobId job;
  Codec codec = Codec::kNone;
  std::uint32_t raw_bytes = 0;
  Payload body;
};

// ---- core -> log
// -----------------------------------------------------------------------------------------

enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarn, kError };
struct Log {
  LogLevel level = LogLevel::kInfo;
  std::string text;
};
struct Stopped {};

using Action = std::variant<CreateSubscription, DestroySubscription, CreateMirror, DestroyMirror,
                            Publish, RefreshGraph, Dial, OpenGate, CloseConnection, Authenticate,
                            CompressJob, DecompressJob, Log, Stopped>;

}  // namespace connect_bridge
