// The types of the topics and services that peers offer, as far as they are not the types that are
// installed here.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>

#include "core/base/timers.hpp"
#include "core/link/link.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"
#include "core/types/description_calls.hpp"
#include "core/types/mismatches.hpp"

namespace connect_bridge {

// The mirror, of a topic or of a service, that needs a description.
using TypeUser = std::variant<MirrorId, ServiceMirrorId>;

// Asks the peers for the descriptions that something here needs, checks them against their hashes,
// and keeps them as long as a channel with that type and hash is offered, or a mirror here has it.
// The first peer that gives one of them gives it for all links: it is the same for all that have
// the hash. What is kept counts in the memory of the link that gave it. Single-threaded; owned by
// the side.
class PeerTypes {
 public:
  // A peer that has not answered by then is not waited for; another one is asked.
  static constexpr Duration kPatience = std::chrono::seconds(5);
  // A peer that did not know it may know it later: it may not have discovered the node yet.
  static constexpr Duration kAskAgain = std::chrono::seconds(10);
  static constexpr int kAsksMax = 3;  // one connection about one type

  explicit PeerTypes(Outputs& outputs) : outputs_(outputs), mismatches_(outputs), calls_(outputs) {}
  PeerTypes(const PeerTypes&) = delete;
  PeerTypes& operator=(const PeerTypes&) = delete;

  // Before every input: the present.
  void begin(const Now& now) { now_ = now.steady; }

  // A channel with this definition is offered, or ends. Without a hash neither does anything.
  void add(Link& link, ChannelId channel, const Definition& type);
  void remove(Link& link, ChannelId channel, const Definition& type);
  // Its channels are about to end; those that the link offers again go on.
  void on_link_lost(const Link& link);
  void on_link_dead(LinkId link);

  // A mirror has a type that is not installed: DescribeType follows for the first one of a type,
  // when it is known. `node`: to which the mirror belongs; empty: our own.
  void need(const Definition& type, TypeUser mirror, const std::string& node);
  // The mirror ends. Of others nothing is known here.
  void release(TypeUser mirror);
  // The same to explain why the type here is not the peer's: one line for the log, at the latest
  // after Mismatches::kPatience.
  void explain(Mismatch mismatch, const Now& now);

  // An error ends the connection with its code.
  Result<Nothing> on_description(Link& link, const Description& description);
  void on_looked_up(const TypeLookedUp& found);
  void on_time(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const {
    return earliest(earliest(timers_.deadline(), mismatches_.deadline()), calls_.deadline());
  }

  // The nodes here that have mirrors with types that are not installed, and how many of these; our
  // own node's name is empty. take_nodes_change(): true once after they have changed.
  [[nodiscard]] const std::map<std::string, std::size_t>& nodes() const { return nodes_; }
  bool take_nodes_change() { return std::exchange(nodes_changed_, false); }
  // Nodes here that ask what peers' types are made of.
  [[nodiscard]] DescriptionCalls& calls() { return calls_; }

 private:
  // A link that offers it.
  struct Source {
    Link* link = nullptr;
    std::set<ChannelId> channels;
    int asks = 0;       // whatever the answers were
    TimePoint again{};  // not before
    // The one to ask about.
    [[nodiscard]] ChannelId channel() const { return *channels.begin(); }
  };
  // The peer to ask for a type.
  struct Choice {
    Source* free = nullptr;          // not asked before, or long ago
    const Link* full = nullptr;      // the first one that has enough questions
    std::optional<TimePoint> again;  // when one that was asked may be asked again
  };
  struct PeerType {
    std::map<LinkId, Source> sources;
    std::size_t users = 0;  // mirrors
    bool unusable = false;  // the description, whoever gives it
    // The answer that it waits for.
    std::optional<std::pair<LinkId, ChannelId>> asked;
    // Its place in the line of a link, when all that may be asked have enough questions.
    std::optional<std::pair<LinkId, std::uint64_t>> turn;
    Timers<Definition>::Timer next;  // then another one is asked
    std::string text;                // empty: not known
    LinkId holder;                   // whose memory it counts in
    Budget::Hold bytes;
  };
  struct Questions {
    // Under way; without a type: nobody waits for the answer any longer.
    std::map<ChannelId, std::optional<Definition>> open;
    std::map<std::uint64_t, Definition> waiting;  // each type in one line at the most
  };
  struct User {
    Definition type;
    std::string node;
  };
  using Types = std::map<Definition, PeerType>;

  // Asks one of those who offer it, waits in line, or tells that it will not come.
  void ask(const Definition& name, PeerType& type);
  [[nodiscard]] Choice choose(PeerType& type);
  void ask(const Definition& name, PeerType& type, Source& source);
  void queue(const Definition& name, PeerType& type, const Link& link);
  void leave_line(PeerType& type);
  void ask_next(Link& link);
  static void forget_withdrawn(const Link& link, Questions& questions);
  void keep(const Definition& name, PeerType& type, Link& link, const std::string& text);
  [[nodiscard]] bool wants(const Definition& name, const PeerType& type) const;
  void drop_unused(Types::iterator type);
  static void hold(PeerType& type);
  // To all who have asked; empty: it will not come.
  void tell(const Definition& name, const std::string& text);

  Outputs& outputs_;
  Mismatches mismatches_;
  DescriptionCalls calls_;
  TimePoint now_{};
  std::uint64_t last_turn_ = 0;
  Timers<Definition> timers_;
  Types types_;
  std::map<TypeUser, User> users_;
  std::map<std::string, std::size_t> nodes_;
  bool nodes_changed_ = false;
  std::map<LinkId, Questions> questions_;
};

}  // namespace connect_bridge
