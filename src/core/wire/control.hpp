// Control messages after login: JSON in WebSocket text messages. docs/protocol.md section "Control
// messages".
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/ids.hpp"
#include "core/base/priority.hpp"
#include "core/base/qos.hpp"
#include "core/base/result.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge {

// Limits of one control message; larger ones are refused with kTooLarge. Reading a message takes
// less than 4 ms within them, whatever it holds (tests/bench/core_bench.cpp).
inline constexpr std::size_t kControlBytesMax = 256 << 10;
inline constexpr std::size_t kControlDepthMax = 8;        // nesting of JSON objects and arrays
inline constexpr std::size_t kControlValuesMax = 16'384;  // JSON values in one message
inline constexpr std::size_t kControlMembersMax = 64;     // of one JSON object
inline constexpr std::size_t kOfferChannelsMax = 256;     // channels in one offer
inline constexpr std::size_t kChannelOriginsMax = 1024;   // origins of one channel
// Origins and listeners that one message adds. Those of usual names make about 16 KiB.
inline constexpr std::size_t kAddedMax = 64;
inline constexpr std::size_t kRemovedMax = 1024;         // and removes
inline constexpr std::size_t kChannelIdsMax = 4096;      // channels in one withdraw
inline constexpr std::size_t kDemandChannelsMax = 1024;  // channels in one demand
inline constexpr std::size_t kHasMax = 64;               // origins of one `has`
inline constexpr std::size_t kDecodesMax = 16;           // words of one `decodes`
inline constexpr std::size_t kAcceptRulesMax = 1024;     // rules in one accepts
inline constexpr std::size_t kAcceptEntriesMax = 4096;   // patterns and types of one accepts
inline constexpr std::size_t kWildcardsMax = 256;        // patterns with a star of one accepts
inline constexpr std::size_t kWildcardBytesMax = 4096;   // of these, each from its first star on
inline constexpr std::size_t kNameBytesMax = 255;        // a name, pattern, type, hash or node
inline constexpr std::size_t kListenersMax = 1024;       // listeners of a link
inline constexpr std::size_t kCallIdsMax = 8192;         // calls in one message
inline constexpr std::size_t kAskedMax = 64;             // names in one question
inline constexpr std::size_t kFindingsMax = 16;          // of one side about one link
inline constexpr std::size_t kCodeBytesMax = 32;         // of a decline, refuse, withdraw or answer
inline constexpr std::size_t kReasonBytesMax = 512;      // the sentence with it
inline constexpr Duration kDurationMax{(std::int64_t{1} << 62) - 1};  // longer is kForever

// kOther: a kind of a later protocol version. Decline it with "unsupported".
enum class InterfaceKind : std::uint8_t { kTopic, kService, kAction, kOther };

// One real publisher of an exported topic.
struct OriginOffer {
  OriginId origin;
  Gid gid;
  std::string node;  // fully qualified name of the node that owns it
  Qos qos;
};

// A channel in an offer. An action is offered as its parts: three services and two topics with
// hidden names, each with its own channel (docs/protocol.md section "Services and actions").
struct ChannelOffer {
  ChannelId channel;
  InterfaceKind kind = InterfaceKind::kTopic;  // kTopic or kService
  std::string name;                            // canonical, absolute
  std::string type;                            // "std_msgs/msg/String", "std_srvs/srv/SetBool"
  std::string type_hash;    // topic: "RIHS01_..." (REP-2016); empty: there is none
  std::string action_type;  // part of an action: "example_interfaces/action/Fibonacci"
  Priority priority = Priority::kNormal;
  bool newest_only = false;  // the importer, too, keeps only the newest message (for /clock)
  bool resume = false;       // topic: continues the previous connection, also its sequences
  std::vector<OriginOffer> origins;  // topic
  std::string node;         // service: fully qualified name of the node that serves it, or empty
  std::uint32_t epoch = 0;  // service: see "epoch" in docs/architecture.md; a new number
                            // means that the exporter remembers no calls
};

// "offer": these channels exist now. `complete` is true on the last offer of the first round.
struct Offer {
  std::vector<ChannelOffer> channels;
  bool complete = false;
};
// "origins": publishers of an offered channel came or went.
struct OriginsChanged {
  ChannelId channel;
  std::vector<OriginOffer> added;
  std::vector<OriginId> removed;
  // Messages of the channel that the exporter dropped until now because they are larger than the
  // importer's limit, and the bytes of the last one.
  std::uint64_t too_large = 0;
  std::uint64_t too_large_bytes = 0;
};
// "withdraw": these channels are gone; no frame for them follows. If the exporter cannot serve
// them, it gives the reason, as in a decline.
struct Withdraw {
  std::vector<ChannelId> channels;
  std::string code = {};
  std::string reason = {};
};
// The bodies that an importer decodes beside those of codecs 0 to 4.
struct Decodes {
  bool vp8 = false;     // Codec::kPictureBase, Codec::kPictureDelta
  bool cloud = false;   // Codec::kCloud
  bool planes = false;  // Codec::kPlanes

  friend bool operator==(const Decodes&, const Decodes&) = default;
};
// May messages of this codec answer a demand with these `decodes`?
[[nodiscard]] constexpr bool may_answer(const Decodes& decodes, Codec codec) {
  switch (codec) {
    case Codec::kNone:
    case Codec::kLz4:
    case Codec::kZstd:
    case Codec::kZstdBase:
    case Codec::kZstdDelta: return true;
    case Codec::kPictureBase:
    case Codec::kPictureDelta: return decodes.vp8;
    case Codec::kCloud: return decodes.cloud;
    case Codec::kPlanes: return decodes.planes;
  }
  return false;
}
// The largest number of the samples of a transient-local origin that the importer has.
struct HeldSamples {
  OriginId origin;
  std::uint64_t number = 0;

  friend bool operator==(const HeldSamples&, const HeldSamples&) = default;
};
// The importer wants, or no longer wants, the messages of one channel.
struct ChannelDemand {
  ChannelId channel;
  std::uint16_t number = 0;  // carried by its messages from now on; 0: not wanted any longer
  // The exporter keeps messages that a lost connection loses, and sends them again on the next one.
  bool resume = false;
  // The last sequence that arrived on the previous connection: the channel goes on behind it.
  std::optional<std::uint32_t> after = {};
  bool live = false;  // no messages from before the demand
  Decodes decodes = {};
  bool lossy = false;                 // forms that are not exact may come, too
  std::vector<HeldSamples> has = {};  // samples up to these numbers need not come
};
// "demand": the demands of these channels, in order.
struct Demand {
  std::vector<ChannelDemand> channels;
};
// "accepts": the interfaces that this side would import, so that the peer offers only those. One
// entry per rule.
struct AcceptedNames {
  std::vector<std::string> topics;           // patterns
  std::vector<std::string> types;            // empty: any
  std::vector<std::string> services = {};    // patterns
  std::vector<std::string> actions = {};     // patterns
  std::vector<std::string> parameters = {};  // patterns of node names

  friend bool operator==(const AcceptedNames&, const AcceptedNames&) = default;
};
struct Accepts {
  std::vector<AcceptedNames> rules;
  std::vector<std::string> deny;        // patterns, win over all rules
  std::uint32_t message_bytes_max = 0;  // largest message that this side accepts; 0: not given
  bool ros_time = false;                // this side publishes the peer's ROS time
  std::string robot = {};               // "sender" or "receiver": which end is the robot
  Token128 base = {};                   // digest of texts kept from the connection before; or none
  bool findings = false;                // this side takes "findings"

  friend bool operator==(const Accepts&, const Accepts&) = default;
};
// "decline": the importer does not import this channel, with the reason for the exporter's log and
// status.
struct Decline {
  ChannelId channel;
  // "not_permitted", "type_mismatch", "type_unknown", "qos", "failed", "unsupported", "limit"
  std::string code;
  std::string reason;  // one sentence
};

// The subscriptions of one node to one topic.
struct ListenerReport {
  ListenerId listener;
  std::string name;       // of the topic: canonical, absolute
  std::string type;       // "std_msgs/msg/String"
  std::string type_hash;  // as in ChannelOffer
};
// "listeners": topics that nodes of the sender's graph subscribe to, or no longer do, and that the
// peer may publish here. The peer need not offer them.
struct Listeners {
  std::vector<ListenerReport> added;
  std::vector<ListenerId> removed;  // removed before others are added
};

// "attach": the importer would make a mirror of this service; its requests come on the channel
// `requests`, one of the importer's own numbers.
struct Attach {
  ChannelId channel;
  ChannelId requests;
};
// "attached": the real service can be called; the mirror may exist now.
struct Attached {
  ChannelId channel;
  ChannelId requests;  // as in the attach that this message answers
  CallId seen;         // the last call of this epoch whose request arrived, or none
  // Calls up to `seen` that are still to be answered or refused. Other calls were answered or
  // refused on a lost connection.
  std::vector<CallId> calls = {};
  std::string type_hash = {};  // of the service type, as type_hash in an offer
};
// "refuse": the exporter will not answer these calls.
struct Refuse {
  ChannelId channel;
  std::vector<CallId> calls;
  std::string code;    // "limit", "timeout", "failed", "lost"
  std::string reason;  // one sentence
};
// "forget": the importer does not want answers to these calls any longer.
struct Forget {
  ChannelId channel;
  std::vector<CallId> calls;
};

// A topic or service that a node of the asking side's graph uses and that is not there.
struct AskedName {
  InterfaceKind kind = InterfaceKind::kTopic;  // kOther: of a later version
  std::string name;                            // on the wire
  std::string type;

  friend bool operator==(const AskedName&, const AskedName&) = default;
};
// "ask": why does the peer not offer these?
struct Ask {
  std::vector<AskedName> names;
};
// "answer": for each name, in order: "not_permitted", "absent", "other_type", "type_unknown",
// "unsupported", "there", "later".
struct Answered {
  std::vector<std::string> codes;
};

// "wheel": who steers the topic of this channel. The robot imports it and sends `state`; the
// operator exports it and sends `want`. Exactly one of the two is there.
enum class WheelState : std::uint8_t { kFree, kYours, kTaken, kHalted };
enum class WheelWant : std::uint8_t { kTake, kLeave };
struct Wheel {
  ChannelId channel;
  std::optional<WheelState> state = {};
  std::optional<WheelWant> want = {};
};

// "renew": the client logs in again on the open connection, before its login expires.
struct Renew {
  std::string method;
  std::string credential;  // of printable ASCII
};
// "renewed": the server's answer. Not accepted: the former login stays.
struct Renewed {
  bool accepted = false;
};

// A fault at the sender that concerns the receiver, for people.
struct PeerFinding {
  std::string id;    // of docs/findings.md
  std::string name;  // of a topic or service; empty: the whole link

  friend bool operator==(const PeerFinding&, const PeerFinding&) = default;
};
// "findings": all that there are now.
struct Findings {
  std::vector<PeerFinding> list;
};

using Control =
    std::variant<Offer, OriginsChanged, Withdraw, Demand, Accepts, Decline, Attach, Attached,
                 Refuse, Forget, Renew, Renewed, Listeners, Ask, Answered, Wheel, Findings>;

// The size of all lists of an `accepts` together.
struct AcceptsSize {
  std::size_t entries = 0;         // patterns and types
  std::size_t wildcards = 0;       // patterns with a star
  std::size_t wildcard_bytes = 0;  // of these, each from its first star on
};
[[nodiscard]] AcceptsSize size_of(const Accepts& accepts);

// The caller observes the limits above; encode_parts() and encode_offers() do it for long lists.
std::string encode(const Control& message);

// The messages that together stand for `message`, in order, each with its piece of every list. Not
// for an offer. Lists that must not be split are short enough: those of "attached" and "accepts",
// and removals. The peer applies all removals before it counts what is added.
std::vector<std::string> encode_parts(const Control& message);

// The messages that announce all of `channels`, each within the limits: offers, and for a channel
// with many origins "origins" behind the offer. `complete` is set on the last offer, which is the
// last message. With `complete` there is an offer even without channels.
std::vector<std::string> encode_offers(const std::vector<ChannelOffer>& channels, bool complete);

// Unknown message types are an error (kMalformed); unknown keys are ignored, so that later minor
// versions can add some. Checks sizes, ranges, UTF-8 and nesting; names are not checked for being
// canonical here (policy does). For a channel of kind kOther only number, kind and name are read.
Result<Control> decode_control(std::string_view text);

}  // namespace connect_bridge
