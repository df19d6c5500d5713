// The wheels of the topics that drive this robot.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/base/timers.hpp"
#include "core/driving/wheel.hpp"
#include "core/graph/graph_view.hpp"
#include "core/link/link.hpp"

namespace connect_bridge {

struct ImportContext;
class TopicMirror;

// A command that a mirror is about to publish.
struct SteeringCommand {
  driving::CommandType type{};
  Payload raw;
  bool moves = true;
  Duration age{0};
  driving::WheelRules rules;
  std::string rule;  // name
};

// Gives each wheel its commands, its deadlines and the ends of links, and does what it says: zeros
// to publish, lines of the audit log. A wheel exists from the first command that moves. The context
// is that which owns this. Single-threaded.
class Wheels {
 public:
  // May the command be published? False: the wheel is another's.
  [[nodiscard]] bool judge(ImportContext& context, TopicMirror& mirror, const Link& link,
                           const SteeringCommand& command, const Now& now);
  // A command of the mirror was too old.
  void on_old(const TopicMirror& mirror);
  // The link has ended; its mirrors still exist.
  void on_link_end(ImportContext& context, const Link& link, const Now& now);
  // Our rules do not allow the topic to the link any longer.
  void on_right_end(ImportContext& context, const TopicKey& key, const Link& link, const Now& now);
  // The rule has no wheel for the link any longer: its commands are not judged.
  void on_rule_without(ImportContext& context, const TopicKey& key, const Link& link,
                       const Now& now);
  // The peer would take or leave the wheel. `rule`: that allows the topic to it.
  void on_wanted(ImportContext& context, const TopicKey& key, const Link& link, WheelWant want,
                 const std::string& rule, const Now& now);
  // A peer that offers the topic from now on is to be told who steers.
  void on_offered(const TopicKey& key, const Now& now);
  // This side stops: everybody who steers is halted now.
  void on_stop(ImportContext& context, const Now& now);
  void on_time(ImportContext& context, const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const { return timers_.deadline(); }

  // The mirror lives until then; nullopt: no halt needs it.
  [[nodiscard]] std::optional<TimePoint> needs(const TopicMirror& mirror) const;
  // The wheel of a topic; null: nobody has steered it.
  [[nodiscard]] const driving::Wheel* find(const TopicKey& key) const;

 private:
  struct Entry {
    driving::Wheel wheel;
    driving::CommandType type{};
    bool to_tell = false;
    TimePoint sent_at{};  // when peers were told last who steers
    Timers<const TopicKey*>::Timer timer{};
  };
  using Found = std::map<TopicKey, Entry>::iterator;

  void end(ImportContext& context, Found wheel, const Link& link, driving::WheelCause cause,
           const Now& now);
  void follow(ImportContext& context, Found wheel, driving::WheelStep step, const Now& now);
  // Tells each peer that offers the topic who steers, but not too often.
  static void tell_peers(ImportContext& context, Found wheel, const Now& now);
  void set_timer(Found wheel);
  // The wheel of a topic, made if necessary.
  Found open(const ImportContext& context, const TopicKey& key, const Now& now);
  void forget_idle(const Now& now);

  Timers<const TopicKey*> timers_;
  std::map<TopicKey, Entry> wheels_;
};

// The driver of a link's commands: its identity, without a login the process of the peer.
[[nodiscard]] std::string driver_of(const Link& link);

}  // namespace connect_bridge
