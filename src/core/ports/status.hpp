// A picture of a side for people and tests: links, channels, rates, drops, clock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/flow/drops.hpp"
#include "core/policy/treatment.hpp"
#include "core/ports/failure.hpp"
#include "core/wire/control.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {

// The state of a topic, a service or a link in one word, the same in every view.
enum class StateWord : std::uint8_t {
  kDeclined,      // exported: the peer does not import it
  kKept,          // exported: messages are kept until the link returns
  kNoSubscriber,  // where it is imported
  kNoPublisher,   // where it is exported
  kOverloaded,    // exported: the link carries less than is published
  kFlows,
  kQuiet,     // nothing is published now
  kNoClient,  // a service that nobody uses where it is imported
  kReady,     // a service that can be called
  kOpen,      // a link
  kLost,      // a link that may return
};

inline constexpr std::array<Word<StateWord>, 11> kStateWords{{
    {StateWord::kDeclined, "declined"},
    {StateWord::kKept, "kept"},
    {StateWord::kNoSubscriber, "no_subscriber"},
    {StateWord::kNoPublisher, "no_publisher"},
    {StateWord::kOverloaded, "overloaded"},
    {StateWord::kFlows, "flows"},
    {StateWord::kQuiet, "quiet"},
    {StateWord::kNoClient, "no_client"},
    {StateWord::kReady, "ready"},
    {StateWord::kOpen, "open"},
    {StateWord::kLost, "lost"},
}};

[[nodiscard]] constexpr std::string_view name_of(StateWord state) {
  return word_of(kStateWords, state);
}

// The form in which a message leaves or comes, if it is one of pictures or clouds.
struct SentAs {
  Codec codec = Codec::kNone;  // kPlanes, kCloud, kPictureBase; kNone: any other
  std::uint32_t step_um = 0;   // points are rounded to this many micrometres; 0: exact
  std::uint8_t quantiser = 0;  // of a VP8 picture
  bool half = false;           // it has half the width and height
  std::string_view because{};  // exported: why it is not exact
  [[nodiscard]] bool is_exact() const { return step_um == 0 && quantiser == 0; }
};

// One topic on one link, as seen from this side.
struct TopicStatus {
  std::string topic;  // local name
  std::string type;
  bool exported = false;  // else imported
  bool demanded = false;  // data flows
  bool kept = false;      // exported: some messages wait for the return of a lost link
  std::uint32_t origins = 0;
  std::uint64_t messages = 0;  // exported: handed to the connection; imported: published
  std::uint64_t bytes = 0;     // uncompressed
  std::uint64_t wire_bytes = 0;
  std::uint64_t queued = 0;
  // The latency of the last message. Imported: from the origin's stamp to publication, clock offset
  // corrected. Exported: the time that the message waited here before it began to leave.
  std::optional<double> latency_ms;
  // While it is demanded: since the last message was published (exported: taken here for the peer),
  // or since it was demanded; and how many came in a second before that, if many have come.
  std::optional<Duration> idle{};
  std::optional<double> usual_rate{};
  static constexpr Duration kQuiet = std::chrono::seconds(10);
  // Exported: more than 1 where the link carries less than is published.
  double published_for_each_sent = 1;
  DropCounts dropped;
  Keep keep = Keep::kAll;         // exported
  std::string_view keep_because;  // exported: why
  SentAs sent_as;                 // the last message
  std::string declined;           // exported: why the peer does not import it; empty if it does
  std::string declined_code;      // its word in the protocol
  std::string rule;               // of ours, that lets it cross
  // Imported: what some subscriber here requests and no publisher offers ("reliability"); empty:
  // all can receive.
  std::string misfit;
  // Of a topic that drives a robot: who steers, as the operator is told. nullopt: not known.
  std::optional<WheelState> wheel;
  // Imported: a node of this graph that publishes the topic, too; empty: none does.
  std::string also_from;
  // Imported: the clock of a publisher's machine is ahead of its bridge's.
  std::optional<double> ahead_ms;

  // The growth of some counts in the last minutes. Whoever takes pictures adds it.
  struct Lately {
    std::uint64_t messages = 0;
    std::uint64_t wire_bytes = 0;
    DropCounts dropped;
  };
  std::optional<Lately> lately;

  // Exported: messages that this side took for the peer, forwarded or not.
  [[nodiscard]] std::uint64_t published() const { return messages + dropped.total() + queued; }

  // The counts of the same topic on an earlier connection of the link.
  void add_past(const TopicStatus& past) {
    messages += past.messages;
    bytes += past.bytes;
    wire_bytes += past.wire_bytes;
    for (std::size_t i = 0; i < kDropReasons; ++i)
      dropped.by_reason[i] += past.dropped.by_reason[i];
  }
};

// One service on one link. Exported: the peer calls; imported: callers here do.
struct ServiceStatus {
  std::string service;  // local name
  std::string type;
  bool exported = false;      // else imported
  bool attached = false;      // calls can be made
  std::uint32_t pending = 0;  // calls without an answer, those that wait among them
  std::uint32_t waiting = 0;  // exported: for their turn at the real server
  std::optional<Duration>
      oldest{};  // how long the oldest call has had no answer; nullopt: none has
  std::uint64_t calls = 0;
  std::uint64_t answered = 0;
  std::uint64_t refused = 0;     // at a limit, or impossible
  std::uint64_t timed_out = 0;   // given up after the rule's call_timeout
  std::uint64_t forgotten = 0;   // their caller went away
  std::uint64_t lost = 0;        // with the link or the server
  std::uint64_t duplicates = 0;  // requests or answers that had arrived before, or came too late
  std::uint64_t request_bytes = 0;
  std::uint64_t response_bytes = 0;
  std::string declined;       // exported: why the peer does not import it; empty if it does
  std::string declined_code;  // its word in the protocol
  std::string rule;           // of ours, that lets it cross
  bool also_here = false;     // imported: not mirrored, as a node of this graph serves it
  bool several_here = false;  // exported: several nodes of this graph serve it

  // As of a topic.
  struct Lately {
    std::uint64_t answered = 0;
    std::uint64_t timed_out = 0;
    std::uint64_t refused = 0;
    std::uint64_t lost = 0;
  };
  std::optional<Lately> lately;
};

// Why a name does not cross.
enum class MissingReason : std::uint8_t {
  kNoRule,       // no rule here names it
  kOtherPeer,    // a rule here allows it to other peers only
  kDenied,       // a rule here denies it
  kRuleType,     // a rule here names it, and allows other types only
  kNotTaken,     // exported: the peer's rules do not take it
  kNotGiven,     // imported: the peer's rules do not let this side have it
  kOtherType,    // it exists at the peer, or is listened to there, with another type
  kNotThere,     // nobody publishes or serves it there
  kTypeUnknown,  // its type is not installed where it has to be
  kDeclined,     // the importer declined it, and said why
  kQos,          // a subscriber requests what no publisher offers
  kLost,         // many of its samples are lost before they reach the bridge
  kOutside,      // the peer listens to it, and its name here is not below our prefix
};

inline constexpr std::array<Word<MissingReason>, 13> kMissingWords{{
    {MissingReason::kNoRule, "no_rule"},
    {MissingReason::kOtherPeer, "other_peer"},
    {MissingReason::kDenied, "denied"},
    {MissingReason::kRuleType, "rule_type"},
    {MissingReason::kNotTaken, "not_taken"},
    {MissingReason::kNotGiven, "not_given"},
    {MissingReason::kOtherType, "other_type"},
    {MissingReason::kNotThere, "not_there"},
    {MissingReason::kTypeUnknown, "type_unknown"},
    {MissingReason::kDeclined, "declined"},
    {MissingReason::kQos, "qos"},
    {MissingReason::kLost, "lost"},
    {MissingReason::kOutside, "outside_prefix"},
}};

// Who waits for a name that does not cross.
enum class Waiting : std::uint8_t {
  kNobody,
  kHere,    // a node here subscribes or calls
  kPeer,    // a node at the peer subscribes
  kSender,  // a node here that sends it on purpose: a rule here names it, or the node only sends
};

inline constexpr std::array<Word<Waiting>, 4> kWaitingWords{{
    {Waiting::kNobody, "nobody"},
    {Waiting::kHere, "here"},
    {Waiting::kPeer, "peer"},
    {Waiting::kSender, "sender"},
}};

// One name on one link.
struct MissingName {
  static constexpr std::size_t kMissingMax = 64;  // of a link

  InterfaceKind kind = InterfaceKind::kTopic;
  bool exported = false;  // published here; else somebody here subscribes or calls
  std::string name;       // local; of an action its own
  std::string type;
  MissingReason reason = MissingReason::kNoRule;
  std::string rule;  // of ours, that decides; empty: none does
  std::string text;  // one sentence
  std::string code;  // kDeclined: the importer's word in the protocol
  Waiting waits = Waiting::kNobody;

  friend bool operator==(const MissingName&, const MissingName&) = default;
};

struct ClockStatus {
  bool known = false;
  Duration offset{0};       // peer's system clock minus ours
  Duration round_trip{0};   // of the best sample
  Duration error_bound{0};  // half of it
  std::uint64_t samples = 0;
  Duration last_round_trip{0};  // of the last sample
  Duration last_offset{0};
};

// One time that a link was lost.
struct LinkBreak {
  static constexpr std::size_t kShownMax = 8;  // of a link, the newest
  static constexpr std::size_t kReasonBytesMax = 200;

  Stamp lost = 0;
  Stamp back = 0;  // 0: the link has not returned
  Failure why;
  bool by_peer = false;  // the peer closed the connection, with the cause as its code
};

struct LinkStatus {
  TimePoint at{};            // the moment of this picture
  std::uint64_t number = 0;  // of this link, while this process lives
  std::string peer;          // address
  std::string node;          // the peer's node name
  std::string identity;      // who it logged in as; at a client: what proves the server is
  bool open = false;
  Duration open_for{};  // while it is open
  Stamp login_end = 0;  // at a server, while it is open: when the login ends; 0: never
  std::uint64_t sent_bytes = 0;
  std::uint64_t received_bytes = 0;
  std::uint64_t queued_bytes = 0;
  std::uint64_t unacknowledged_bytes = 0;
  std::uint64_t memory_bytes = 0;  // what this side holds because of the peer, part of memory_max
  double rate = 0;                 // bytes per second that the path to it carries; 0: not known
  Duration path_queue{};           // how long packets wait on it
  std::uint64_t connects = 0;
  std::vector<LinkBreak> breaks;  // the newest last
  bool same_graph = false;        // the peer's bridge is in the graph of this side
  bool two_of_a_kind = false;     // both ends say that they are the robot, or both the operator
  ConnectionId connection;        // while it is open
  Duration unheard{};             // time since the peer was heard, while it is open
  std::vector<PeerFinding> peer_findings;  // of the peer about this link; local names
  // TCP segments with data on this connection, and of these the retransmitted ones. Whoever owns
  // the socket adds them.
  std::uint64_t segments = 0;
  std::uint64_t retransmitted = 0;
  // The worst, or the growth, of the last minutes. Whoever takes pictures adds it.
  struct Lately {
    Duration path_queue{};
    std::uint64_t segments = 0;
    std::uint64_t retransmitted = 0;
  };
  std::optional<Lately> lately;
  // Publishers, services and subscriptions that had to wait for their turn or for a place.
  std::uint64_t mirrors_waited = 0;
  ClockStatus clock;
  // At most kShownMax of each, first those that are in use; what the others have together.
  static constexpr std::size_t kShownMax = 500;
  std::vector<TopicStatus> topics;
  std::vector<ServiceStatus> services;
  std::uint64_t further_topics = 0;
  std::uint64_t further_services = 0;
  TopicStatus further;  // without a name
  // Puts what is beyond kShownMax into these.
  void sum_up();
  // Who steers the robot at the other end, or here, in one word: of its topics that which says
  // most. nullopt: none is driven.
  [[nodiscard]] std::optional<WheelState> wheel() const;
  // Names that somebody here wants and does not get over this link, and why.
  std::vector<MissingName> missing;
  std::uint64_t further_missing = 0;  // beyond kMissingMax
};

[[nodiscard]] StateWord state_of(const TopicStatus& topic);
[[nodiscard]] StateWord state_of(const ServiceStatus& service);
[[nodiscard]] StateWord state_of(const LinkStatus& link);

// A server's connections without a login.
struct StrangersStatus {
  std::size_t waiting = 0;              // now
  std::uint64_t gave_way = 0;           // the oldest, since there were too many
  std::uint64_t wrong_logins = 0;       // or ones that have expired
  std::uint64_t wrong_logins_late = 0;  // of these: answered late, since there were too many
  std::uint64_t shut_out = 0;  // right logins put off, since links of the identity had offended
  std::uint64_t login_timeouts = 0;        // no login in time
  std::uint64_t logins_without_place = 0;  // right ones, refused with 4012
  std::uint64_t logins_not_judged = 0;     // the login method did not answer as it should
  std::string last_wrong_login{};          // why it was wrong; empty: there was none
};

struct Status {
  std::vector<LinkStatus> links;
  StrangersStatus strangers;
  std::uint64_t memory_bytes = 0;      // what queues, histories, bases and reassembly hold
  std::uint64_t shared_bytes = 0;      // of memory_max
  std::uint64_t shared_bytes_max = 0;  // memory_max
  Failure last_failure;                // why the last connection ended
  // Calls that ended without an answer while their callers waited, on all links since the start.
  std::uint64_t made_unanswered = 0;    // of callers here
  std::uint64_t served_unanswered = 0;  // of peers
};

}  // namespace connect_bridge
