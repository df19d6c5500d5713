// What the core asks for: of ROS, the network, the login, the workers and the log.
#pragma once

#include <optional>
#include <string>
#include <variant>

#include "core/base/bytes.hpp"
#include "core/base/close_code.hpp"
#include "core/base/ids.hpp"
#include "core/base/qos.hpp"
#include "core/ports/audit.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge {

// ---- core -> ROS

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
  Qos qos;                      // depth is always given
  std::string node = {};        // the proxy node that is to own it ("/talker"); empty: our own
  bool any_definition = false;  // its hash is not compared with the installed type
};
struct DestroyMirror {
  MirrorId id;
};
// Larger samples are checked beside the loop, and published in their mirror's order. The payload is
// let go on this thread, when that is done.
inline constexpr std::size_t kLargeSample = 1 << 20;

struct Publish {
  MirrorId mirror;
  Payload payload;
};
struct CreateServiceMirror {
  ServiceMirrorId id;
  std::string service;
  std::string type;
  std::string type_hash;  // must be that of the installed type, if both are known
  std::string node = {};  // as in CreateMirror
  bool any_definition = false;
};
struct DestroyServiceMirror {
  ServiceMirrorId id;  // its requests without an answer are forgotten
};
struct SendResponse {
  ServiceMirrorId mirror;
  RequestId request;
  Payload payload;
};
struct DropRequest {
  ServiceMirrorId mirror;
  RequestId request;
};
struct CreateServiceClient {
  ServiceClientId id;
  std::string service;
  std::string type;
};
struct DestroyServiceClient {
  ServiceClientId id;  // no ResponseTaken follows
};
struct SendRequest {
  ServiceClientId client;
  InvocationId invocation;  // chosen by the core
  Payload payload;
  std::optional<Audit> line = {};  // of a peer's call, to be recorded before
};
// The content of the response is not wanted any longer, only the notice that it came.
struct DropInvocation {
  ServiceClientId client;
  InvocationId invocation;
};
// Whether the ROS time of this side is that of /clock.
struct FollowClock {
  bool on = false;
};
// Ask for a new GraphChanged: a sample of this topic came from a publisher not seen yet. That topic
// is looked at first, as the publisher may be gone before a large graph is read.
struct RefreshGraph {
  std::string topic;  // empty: none in particular
};

// ---- core -> network, login, workers

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
// Send what was handed out, then close with this code. No PacketReceived follows, but
// ConnectionClosed does.
struct CloseConnection {
  ConnectionId connection;
  CloseCode code = CloseCode::kNormal;
  std::string reason;  // at most 120 bytes of UTF-8 (RFC 6455: 123)
};
// Open links renew theirs first; strangers take turns, and so do those who renew.
struct Authenticate {
  ConnectionId connection;
  std::string peer;
  std::string method;
  Bytes credential;
  std::string turn{};    // whose: of a stranger's customer, or of the link's identity
  bool renewal = false;  // of an open link
};
// Links take turns, so that one with much work does not hold up the others.
struct CompressJob {
  JobId job;
  Compression how;
  Payload raw;
  LinkId turn = {};  // the link that it is for; none: all links
};
struct DecompressJob {
  JobId job;
  Codec codec = Codec::kNone;
  std::uint32_t raw_bytes = 0;
  Payload body;
  LinkId turn = {};
};
// The result is not wanted any longer; it may still come.
struct CancelJob {
  JobId job;
};

// ---- core -> log

enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarn, kError };
struct Log {
  LogLevel level = LogLevel::kInfo;
  std::string text;
};
struct Stopped {};

using Action =
    std::variant<CreateSubscription, DestroySubscription, CreateMirror, DestroyMirror, Publish,
                 CreateServiceMirror, DestroyServiceMirror, SendResponse, DropRequest,
                 CreateServiceClient, DestroyServiceClient, SendRequest, DropInvocation,
                 FollowClock, RefreshGraph, Dial, OpenGate, CloseConnection, Authenticate,
                 CompressJob, DecompressJob, CancelJob, Log, Audit, Stopped>;

}  // namespace connect_bridge
