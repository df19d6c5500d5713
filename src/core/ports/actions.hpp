// Requests of the core: to ROS, the network, the login, the workers and the log.
#pragma once

#include <cstdint>
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
  std::string node = {};        // the proxy node that owns it ("/talker"); empty: our own
  bool any_definition = false;  // the hash is not compared with the installed type
};
struct DestroyMirror {
  MirrorId id;
};
// Larger samples are checked beside the loop, and published in their mirror's order. Their payload
// is released on this thread afterwards.
inline constexpr std::size_t kLargeSample = 1 << 20;

struct Publish {
  MirrorId mirror;
  Payload payload;
};
struct CreateServiceMirror {
  ServiceMirrorId id;
  std::string service;
  std::string type;
  std::string type_hash;  // must match the installed type's hash, if both are known
  std::string node = {};  // as in CreateMirror
  bool any_definition = false;
};
struct DestroyServiceMirror {
  ServiceMirrorId id;  // unanswered requests are forgotten
};
struct SendResponse {
  ServiceMirrorId mirror;
  RequestId request;
  Payload payload;
};
struct DropRequest {
  ServiceMirrorId mirror;
  RequestId request;
  // The request is for the result of a goal. Its caller is told that the goal was aborted.
  bool aborted = false;
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
// Only the notice that the response came is still wanted, not its content.
struct DropInvocation {
  ServiceClientId client;
  InvocationId invocation;
};
// Should the ROS time of this side be that of /clock?
struct FollowClock {
  bool on = false;
};
// Requests a new GraphChanged: a sample of this topic came from a publisher not seen yet. That
// topic is read first, as the publisher may be gone before a large graph is read.
struct RefreshGraph {
  std::string topic;  // empty: no topic in particular
};

// ---- core -> network, login, workers

// Client only: open a connection to the configured URL under this id.
struct Dial {
  ConnectionId connection;
};
// The peer is authenticated (server: after login; client: after welcome): from now on it may send
// packets of up to packet_bytes_max. Before, the network takes 4096 bytes per packet and 16 KiB in
// total.
struct OpenGate {
  ConnectionId connection;
  std::uint32_t packet_bytes_max = 0;
};
// Sends the packets that were handed out, then closes with this code. Nothing more is read;
// ConnectionClosed follows.
struct CloseConnection {
  ConnectionId connection;
  CloseCode code = CloseCode::kNormal;
  std::string reason;  // at most 120 bytes of UTF-8 (RFC 6455: 123)
};
// Logins of open links are renewed first. Unauthenticated connections take turns, and so do
// renewals.
struct Authenticate {
  ConnectionId connection;
  std::string peer;
  std::string method;
  Bytes credential;
  std::string turn{};    // takes turns as a connection's customer, or the link's identity
  bool renewal = false;  // of an open link
};
// Identities take turns, and the links of one among themselves: neither one with much work nor one
// with many links holds up the others. Zero: work for all links.
struct JobTurn {
  std::uint64_t identity = 0;  // the number of its account
  LinkId link = {};
};
struct CompressJob {
  JobId job;
  Compression how;
  Payload raw;
  JobTurn turn = {};  // of the link that gets the result
};
struct DecompressJob {
  JobId job;
  Codec codec = Codec::kNone;
  std::uint32_t raw_bytes = 0;
  Payload body;
  JobTurn turn = {};
};
// The sample becomes the next picture of those with this id. One job of an id is under way at a
// time. The result is the body (video::facts_of says which one it became); nullopt: the sample is
// no picture, and the next one of the id refers to nothing.
struct EncodePicture {
  JobId job;
  PictureId picture;
  Payload raw;
  std::uint32_t bytes = 0;      // the wanted size of the body
  std::uint32_t bytes_max = 0;  // a body that would be larger has half the width and height
  bool base = false;            // it must refer to nothing
  JobTurn turn = {};
};
struct DecodePicture {
  JobId job;
  PictureId picture;
  std::uint32_t raw_bytes = 0;
  Payload body;
  JobTurn turn = {};
};
// No job of this id follows.
struct EndPicture {
  PictureId picture;
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
                 CompressJob, DecompressJob, EncodePicture, DecodePicture, EndPicture, CancelJob,
                 Log, Audit, Stopped>;

}  // namespace connect_bridge
