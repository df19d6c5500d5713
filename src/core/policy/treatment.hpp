// How messages are treated: what a rule says, and where it does not, what follows from names and
// types. Pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/priority.hpp"
#include "core/base/qos.hpp"
#include "core/wire/codec.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {

// Overrides of the origin's QoS on the mirror and on the exporter's subscription.
struct QosOverride {
  std::optional<Reliability> reliability;
  std::optional<Durability> durability;
  std::optional<std::uint32_t> depth;
  bool operator==(const QosOverride&) const = default;
};

// `qos` with what the rule overrides.
inline Qos with_override(Qos qos, const QosOverride& o) {
  if (o.reliability) qos.reliability = *o.reliability;
  if (o.durability) qos.durability = *o.durability;
  if (o.depth) {
    qos.depth = *o.depth;
    qos.history = History::kKeepLast;
  }
  return qos;
}

// The QoS that an exporter offers for a publisher. Samples of a volatile publisher are kept nowhere
// here, whatever the rule says: a rule of the importing side can latch them there.
inline Qos qos_to_offer(const Qos& qos, const QosOverride& o) {
  Qos result = with_override(qos, o);
  if (qos.durability == Durability::kVolatile) result.durability = Durability::kVolatile;
  return result;
}

// The messages of one publisher that count on a link that carries less than is published: only the
// newest, or all.
enum class Keep : std::uint8_t { kNewest, kAll };
inline constexpr std::array<Word<Keep>, 2> kKeepWords{{
    {Keep::kNewest, "newest"},
    {Keep::kAll, "all"},
}};

// Whether messages may lose something where a link carries too few of them. Unset: kAuto, but a
// picture only beside a CameraInfo.
enum class Lossy : std::uint8_t { kAuto, kNever };
inline constexpr std::array<Word<Lossy>, 2> kLossyWords{{
    {Lossy::kAuto, "auto"},
    {Lossy::kNever, "never"},
}};

// The treatment that a rule gives. Defaults stand for "as the origin has it" or "no limit".
struct Treatment {
  std::optional<Priority> priority;  // none: by name and type, see default_priority()
  Compression compression;
  std::optional<Keep> keep;                // none: see keep_of()
  std::optional<bool> with_large;          // none: see company_of()
  double max_rate = 0;                     // messages per second and publisher; 0: no limit
  std::uint64_t bytes_per_second_max = 0;  // per publisher; 0: no limit
  Duration max_age = kForever;  // older messages are dropped, at the sender and at the importer
  std::uint64_t queue_bytes_max = 0;  // a channel's queue; one message always fits; 0: by the link
  std::optional<Lossy> lossy;
  double max_error = 0.005;  // metres by which a point of a cloud may move, where it may at all
  double grid = 0;  // metres: one point of a cloud for each cell of that size; 0: all points
  QosOverride qos;
  std::optional<bool> resume;        // none: see resumes()
  std::optional<bool> drives;        // none: see drives()
  bool wheel = true;                 // one peer steers at a time, where the robot imports commands
  Duration halt_after = kForever;    // of silence of who steers: then the robot's side says zero
  bool let_go = true;                // whoever was halted lets go before the next command
  std::uint32_t calls_max = 64;      // calls of a service that the real server has at a time
  std::uint32_t server_queue = 10;   // requests that the server's queue keeps; 0: not limited here
  Duration call_timeout = kForever;  // after it a call is given up, except for an action's result
  // A goal is cancelled when the link that sent it has been lost for this time.
  Duration cancel_after = kForever;
  // A type is used although its definition here is not the peer's.
  bool allow_type_mismatch = false;
  bool operator==(const Treatment&) const = default;
};

// Whether an offer under `before` stays where the rules now say `after`: they differ only in keys
// that the exporter follows from the next message on, or that concern imports.
[[nodiscard]] bool may_follow(Treatment before, const Treatment& after);

// ---- priority, and what comes late

// A topic's priority where a rule gives none: /clock and what steers (Twist, Joy, AckermannDrive)
// are urgent; /tf, /tf_static, joint states and the status of actions (small, rare, and what an
// operator looks at) are high; images, point clouds, maps and other large standard types are bulk;
// everything else, feedback too, is normal.
[[nodiscard]] Priority default_priority(std::string_view topic, std::string_view type);
// Whether a topic moves a robot or sets its clock: what comes late on it is worse than what never
// comes, so nothing crosses that was published before the connection or the demand. If the rule
// does not say, as far as its type and the last part of its name show.
[[nodiscard]] bool drives(const Treatment& treatment, std::string_view topic,
                          std::string_view type);
// Whether a person looks at it, and wants to see what is now: seconds of kept pictures would take
// as long to arrive, and steering by old ones is dangerous.
[[nodiscard]] bool is_picture(std::string_view type);
// Whether messages of a topic that a lost connection loses are sent again later. If the rule does
// not say: not those of what drives, of pictures, of urgent topics, and of topics with a max_age.
[[nodiscard]] bool resumes(const Treatment& treatment, std::string_view topic,
                           std::string_view type);

// Whether messages of a type have columns of their own: pictures as planes, clouds by their fields.
[[nodiscard]] bool has_planes(std::string_view type);
[[nodiscard]] bool is_cloud(std::string_view type);

// ---- which messages count

// Properties of a topic's publishers and type, after the rule's overrides of QoS.
struct TopicTraits {
  bool best_effort = false;   // of all of them
  bool keep_all = false;      // of one of them
  std::uint32_t latched = 0;  // samples that one of them keeps for late subscribers
  bool has_header = false;    // the type is installed and begins with a std_msgs/msg/Header
};

struct KeepDecision {
  Keep keep = Keep::kAll;
  std::string_view why;  // for people
};

// The rule's, else: of a state (a pose, an image, a scan, /tf) the newest message replaces the
// earlier ones, of events and increments (logs, goals' feedback, updates of a map) each one counts.
// What is best effort, or begins with a Header, is taken for a state.
[[nodiscard]] KeepDecision keep_of(const Treatment& treatment, std::string_view type,
                                   const TopicTraits& traits);

// ---- what belongs together: an image and its CameraInfo

// How a topic's messages leave: by themselves; as the large ones that others wait for; or with the
// large one of the same stamp, node and namespace.
enum class Company : std::uint8_t { kNone, kLarge, kFollows };

// A CameraInfo follows, and what the rule names (`with_large`), unless it is urgent or high: what
// steers or is looked at first waits for nothing. Large is what is bulk by its type or its rule.
[[nodiscard]] Company company_of(std::string_view topic, std::string_view type,
                                 const Treatment& treatment);

// A hash of the namespace that messages of a topic are matched by. The forms in which
// image_transport sends an image (/camera/image_raw/compressed) are in that of the image.
[[nodiscard]] std::uint64_t company_namespace(std::string_view topic, Company company);
// A hash of a node's name; 0: it is not known.
[[nodiscard]] std::uint64_t company_node(std::string_view node);

}  // namespace connect_bridge
