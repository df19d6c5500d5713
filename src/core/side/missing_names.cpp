#include "core/side/missing_names.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <tuple>

#include "core/driving/command.hpp"
#include "core/offers/export_right.hpp"
#include "core/offers/import_right.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

constexpr std::string_view kRosout = "/rosout";

bool is_hidden(std::string_view name) {
  return name.find("/_") != std::string_view::npos;
}

// The goals of an action stand for all of it.
bool may_be_wished(InterfaceKind kind, const std::string& name, const std::string& type) {
  if (is_of_bridges(name) || name == kRosout || name == kParameterEvents ||
      name == kDiagnosticsTopic)
    return false;
  if (!has_action_token(name)) return true;
  const auto part = part_of_action(kind, name, type);
  return part && part->part == ActionPart::kSendGoal;
}

// Wildcards do not match hidden names, which surprises who uses one.
std::string with_hidden(std::string text, std::string_view name) {
  if (is_hidden(name)) text += "; * and ** match no name that begins with _: write it out";
  return text;
}

std::string_view action_type_of(const Wish& wish) {
  const auto part = part_of_action(wish.kind, wish.name, wish.type);
  return part ? part->action_type : std::string_view{};
}

// Without the action's hidden parts.
std::string_view action_or_name(const Wish& wish) {
  const auto part = part_of_action(wish.kind, wish.name, wish.type);
  return std::string_view(wish.name).substr(0, part ? part->action.size() : std::string::npos);
}

MissingName named(const Wish& wish) {
  MissingName missing;
  missing.kind = wish.kind;
  missing.exported = wish.exported;
  missing.name = wish.name;
  missing.type = wish.type;
  if (const auto part = part_of_action(wish.kind, wish.name, wish.type)) {
    missing.kind = InterfaceKind::kAction;
    missing.name = part->action;
    missing.type = part->action_type;
  }
  return missing;
}

std::string joined(const std::vector<std::string>& words) {
  constexpr std::size_t kWordsMax = 4;
  std::string text;
  for (std::size_t i = 0; i < words.size() && i < kWordsMax; ++i)
    text += (i == 0 ? "" : ", ") + words[i];
  return words.size() > kWordsMax ? text + ", ..." : text;
}

// "/scan" of "/robot1/scan"
std::string_view last_token(std::string_view name) {
  return name.substr(std::min(name.rfind('/'), name.size()));
}

// One of them is the other in a namespace.
bool is_end_of(std::string_view a, std::string_view b) {
  return a.ends_with(b) || b.ends_with(a);
}

struct Why {
  MissingReason reason;
  std::string rule;
  std::string text;
  std::string code = {};  // kDeclined
};

// "; in /camera/* (rule cam) the star is one token, ** is any number of them", where a pattern
// stops a token short of the name.
std::string shorter_pattern(const PolicyTrace& trace, Direction direction, const Opening& opening) {
  for (const RuleTrace& said : trace)
    for (const Pattern& pattern : said.rule->opens[direction][opening.by]) {
      const std::string_view text = pattern.text();
      if (text.ends_with("/*") && opening.name.starts_with(text.substr(0, text.size() - 1)))
        return "; in " + pattern.text() + " (rule " + said.rule->name +
               ") the star is one token, ** is any number of them";
    }
  return {};
}

// "the rule drive here is for other peers (Anna, the group drivers), and this one is anna"
std::string for_others(const Rule& rule, const Identity& who) {
  std::vector<std::string> named = rule.identities;
  for (const std::string& group : rule.groups) named.push_back("the group " + group);
  return "the rule " + rule.name + " here is for other peers (" + joined(named) +
         "), and this one is " + (who.name.empty() ? "nobody" : who.name);
}

// No rule here opens it: which came nearest.
Why why_forbidden(const PolicyTrace& trace, Direction direction, const Opening& opening,
                  std::string_view name, const Identity& who) {
  for (const RuleTrace& said : trace)
    if (said.applies && said.denied_by)
      return {MissingReason::kDenied, said.rule->name,
              "the rule " + said.rule->name + " here denies it (" + said.denied_by->text() + ")"};
  for (const RuleTrace& said : trace)
    if (said.applies && said.opened_by && !said.type_fits)
      return {MissingReason::kRuleType, said.rule->name,
              "the rule " + said.rule->name + " here is only for " + joined(said.rule->types)};
  for (const RuleTrace& said : trace)
    if (said.opened_by && said.type_fits)
      return {MissingReason::kOtherPeer, said.rule->name, for_others(*said.rule, who)};
  return {MissingReason::kNoRule, "",
          with_hidden("no rule here allows it", name) + shorter_pattern(trace, direction, opening)};
}

// The types for which the peer spells the name out; none: not known.
std::vector<std::string> types_taken(const Accepts& accepts, const std::string& wire_name) {
  for (const AcceptedNames& rule : accepts.rules)
    if (std::find(rule.topics.begin(), rule.topics.end(), wire_name) != rule.topics.end())
      return rule.types;
  return {};
}

std::optional<Why> why_answered(const std::string& code, InterfaceKind kind,
                                std::string_view name) {
  if (code == "not_permitted")
    return Why{MissingReason::kNotGiven, "",
               with_hidden("the peer's rules do not export it to this side", name)};
  if (code == "other_type")
    return Why{MissingReason::kOtherType, "", "it has another type at the peer"};
  if (code == "type_unknown")
    return Why{MissingReason::kTypeUnknown, "",
               "it exists at the peer, where its type is not installed"};
  if (code == "absent")
    return Why{MissingReason::kNotThere, "",
               kind == InterfaceKind::kTopic ? "nobody publishes it at the peer"
                                             : "nobody serves it at the peer"};
  return std::nullopt;
}

class Search {
 public:
  Search(const SideView& side, const Link& link, const LinkPicture& picture)
      : side_(side), link_(link), picture_(picture) {
    for (const ChannelFacts& channel : picture.channels)
      if (!channel.exported) {
        offered_[{channel.kind, channel.name}].push_back(channel.type);
        by_last_token_.try_emplace({channel.kind, last_token(channel.name)}, channel.name);
        auto& of_type = by_type_[{channel.kind, channel.type}];
        if (of_type.size() < kOfTypeMax) of_type.emplace_back(channel.name);
      }
    for (const auto& [name, type] : picture.heard) heard_by_type_.try_emplace(type, name);
    for (const auto& [key, topic] : side.graph.topics())
      if (topic.publishers.empty() && key.first != "/clock")
        for (const Endpoint& subscriber : topic.subscribers) lookers_.insert(node_of(subscriber));
    lookers_.erase("");  // not known yet
    for (const auto& [key, topic] : side.graph.topics())
      if (!topic.publishers.empty() && may_be_wished(InterfaceKind::kTopic, key.first, key.second))
        published_.try_emplace({last_token(key.first), key.second}, key.first);
  }

  void import(const Wish& wish);
  void export_lonely(const Wish& wish);
  void export_heard(const TopicKey& heard);
  void channels();
  void declines();
  MissingFound take();

 private:
  using Id = std::tuple<InterfaceKind, bool, std::string, std::string>;

  void add(const Wish& wish, Why why, Waiting waits) {
    add(found_.names, wish, std::move(why), waits);
  }
  void add(std::vector<MissingName>& names, const Wish& wish, Why why, Waiting waits) {
    MissingName missing = named(wish);
    missing.waits = waits;
    if (!known_.insert({missing.kind, missing.exported, missing.name, missing.type}).second) return;
    missing.reason = why.reason;
    missing.rule = std::move(why.rule);
    missing.text = std::move(why.text);
    missing.code = std::move(why.code);
    names.push_back(std::move(missing));
  }
  // nullopt: some rule here allows it.
  [[nodiscard]] std::optional<Why> forbidden(const Wish& wish, const std::string& wire_name) const;
  [[nodiscard]] std::optional<Why> declined(const Wish& wish) const;
  [[nodiscard]] std::optional<Why> elsewhere(const Wish& wish) const;
  // A name of the peer that ends with this one, or the other way round; empty: there is none.
  [[nodiscard]] std::string_view similar_to(const Wish& wish) const;
  // Another name of its type that the peer offers: in its namespace, or the only one. Empty: none.
  [[nodiscard]] std::string_view of_same_type(const Wish& wish) const;
  // "; the peer listens to /cmd_vel of this type", or nothing.
  [[nodiscard]] std::string heard_of_same_type(const Wish& wish) const;
  [[nodiscard]] bool sends(const Wish& wish) const;

  const SideView& side_;
  const Link& link_;
  const LinkPicture& picture_;
  // The types of what the peer offers.
  std::map<std::pair<InterfaceKind, std::string_view>, std::vector<std::string_view>> offered_;
  // One of the names that end with this token.
  std::map<std::pair<InterfaceKind, std::string_view>, std::string_view> by_last_token_;
  // The names of a type that the peer offers, and one that it listens to.
  static constexpr std::size_t kOfTypeMax = 8;
  std::map<std::pair<InterfaceKind, std::string_view>, std::vector<std::string_view>> by_type_;
  std::map<std::string_view, std::string_view> heard_by_type_;
  // One of the topics that are published here, by last token and type.
  std::map<std::pair<std::string_view, std::string_view>, std::string_view> published_;
  MissingFound found_;
  std::vector<MissingName> lonely_;
  std::vector<MissingName> declined_;
  std::set<std::string> lookers_;  // nodes that subscribe to what nobody here publishes
  std::set<Id> known_;
};

std::optional<Why> Search::forbidden(const Wish& wish, const std::string& wire_name) const {
  const Interface what{wish.kind, wire_name, wish.type, action_type_of(wish)};
  const Direction direction = wish.exported ? Direction::kExport : Direction::kImport;
  const Identity& who = link_.login.identity();
  if (side_.policy.decide(direction, what, who)) return std::nullopt;
  // A reason costs as much as there are rules, and what is left out needs none.
  PolicyTrace trace;
  if (found_.names.size() < MissingName::kMissingMax)
    static_cast<void>(side_.policy.decide(direction, what, who, &trace));
  Why why = why_forbidden(trace, direction, opening_of(what), action_or_name(wish), who);
  if (why.reason == MissingReason::kNoRule && wire_name != wish.name &&
      side_.policy.decide(direction, {wish.kind, wish.name, wish.type, what.action_type}, who))
    why.text += "; rules have names without `prefix` and `remap`: " + wire_name;
  return why;
}

std::optional<Why> Search::declined(const Wish& wish) const {
  for (const auto& [number, offer] : link_.declined())
    if (offer.kind == wish.kind && offer.key.first == wish.name && offer.key.second == wish.type)
      return Why{MissingReason::kDeclined, "", "declined here: " + offer.why.reason,
                 offer.why.code};
  return std::nullopt;
}

std::string_view Search::similar_to(const Wish& wish) const {
  const auto found = by_last_token_.find({wish.kind, last_token(wish.name)});
  if (found == by_last_token_.end()) return {};
  const std::string_view name = found->second;
  return is_end_of(wish.name, name) ? name : std::string_view{};
}

std::string_view Search::of_same_type(const Wish& wish) const {
  const auto found = by_type_.find({wish.kind, wish.type});
  if (found == by_type_.end()) return {};
  const auto& names = found->second;
  const auto space_of = [](std::string_view name) { return name.substr(0, name.rfind('/')); };
  const auto near = std::find_if(names.begin(), names.end(), [&](std::string_view name) {
    return space_of(name) == space_of(wish.name);
  });
  if (near != names.end()) return *near;
  return names.size() == 1 ? names.front() : std::string_view{};
}

std::string Search::heard_of_same_type(const Wish& wish) const {
  const auto found = heard_by_type_.find(wish.type);
  if (found == heard_by_type_.end() || found->second == wish.name) return {};
  return "; the peer listens to " + std::string(found->second) + " of this type";
}

// With a prefix no name of the peer is the one that it has there.
std::optional<Why> Search::elsewhere(const Wish& wish) const {
  const std::string_view similar = similar_to(wish);
  if (similar.empty()) return std::nullopt;
  return Why{MissingReason::kNotThere, "",
             "the peer's has the name " + std::string(similar) + " here"};
}

void Search::import(const Wish& wish) {
  const auto wire_name = link_.names.to_wire(wish.name);
  if (!wire_name) {
    if (auto why = elsewhere(wish)) add(wish, *std::move(why), Waiting::kHere);
    return;
  }
  if (auto why = forbidden(wish, *wire_name)) return add(wish, *std::move(why), Waiting::kHere);
  if (auto why = declined(wish)) return add(wish, *std::move(why), Waiting::kHere);
  const auto offered = offered_.find({wish.kind, wish.name});
  if (offered != offered_.end()) {
    const auto& types = offered->second;
    // The name is about to appear, or another bridge brings it.
    if (std::find(types.begin(), types.end(), wish.type) != types.end()) return;
    return add(wish,
               {MissingReason::kOtherType, "",
                "it has another type at the peer: " + std::string(types.front())},
               Waiting::kHere);
  }
  const auto answer = picture_.answers.find(wish);
  if (answer == picture_.answers.end()) return found_.unanswered.push_back(wish);
  auto why = why_answered(answer->second, wish.kind, action_or_name(wish));
  if (why && why->reason == MissingReason::kNotThere) {
    if (auto there = elsewhere(wish))
      why = std::move(there);
    else if (const auto other = of_same_type(wish); !other.empty())
      why->text += "; it has " + std::string(other) + " of this type";
  }
  // The rule may be right, and the namespace wrong.
  if (why && why->reason == MissingReason::kNotGiven)
    if (const auto similar = similar_to(wish); !similar.empty())
      why->text += "; it exports " + std::string(similar);
  if (why) add(wish, *std::move(why), Waiting::kHere);
}

// Most robots publish hundreds of topics that no rule and no peer names.
void Search::export_lonely(const Wish& wish) {
  const auto wire_name = link_.names.to_wire(wish.name);
  if (!wire_name || !link_.accepts) return;
  const Waiting waits = sends(wish) ? Waiting::kSender : Waiting::kNobody;
  if (auto why = forbidden(wish, *wire_name)) {
    auto& names = why->reason == MissingReason::kNoRule ? lonely_ : found_.names;
    why->text += heard_of_same_type(wish);
    return add(names, wish, *std::move(why), waits);
  }
  const TopicState* topic = side_.graph.find({wish.name, wish.type});
  if (!link_.accepts->takes({wish.kind, *wire_name, wish.type})) {
    const auto types = types_taken(link_.accepts->list(), *wire_name);
    if (types.empty() || std::find(types.begin(), types.end(), wish.type) != types.end())
      return add(lonely_, wish,
                 {MissingReason::kNotTaken, "",
                  "the peer's rules do not import it" + heard_of_same_type(wish)},
                 waits);
    return add(wish, {MissingReason::kNotTaken, "", "the peer imports it only as " + joined(types)},
               waits);
  }
  if (topic && topic->lack)
    add(wish, {MissingReason::kTypeUnknown, "", topic->lack->reason}, waits);
}

// A node that also looks at other graphs (RViz) has topics that it may never use; any other one
// publishes in order to send, and so does each that drives.
bool Search::sends(const Wish& wish) const {
  const TopicState* topic = side_.graph.find({wish.name, wish.type});
  const bool drives = driving::command_type(wish.type).has_value();
  const auto means_it = [&](const auto& it) { return drives || !lookers_.contains(node_of(it)); };
  return topic && std::any_of(topic->publishers.begin(), topic->publishers.end(), means_it);
}

// Somebody at the peer listens to it, and may.
void Search::export_heard(const TopicKey& heard) {
  const auto is_published = [](const TopicState& topic) { return !topic.publishers.empty(); };
  const TopicState* same = side_.graph.find(heard);
  const auto wire_name = link_.names.to_wire(heard.first);
  if (!wire_name || !may_be_wished(InterfaceKind::kTopic, heard.first, heard.second)) return;
  const Wish wish{InterfaceKind::kTopic, true, heard.first, heard.second};
  if (same && is_published(*same)) {
    if (auto why = forbidden(wish, *wire_name)) add(wish, *std::move(why), Waiting::kPeer);
    return;
  }
  const TopicState* outside = side_.graph.find({*wire_name, heard.second});
  if (outside && is_published(*outside) && !link_.names.to_wire(*wire_name) &&
      !forbidden(wish, *wire_name))
    return add({InterfaceKind::kTopic, true, *wire_name, heard.second},
               {MissingReason::kOutside, "",
                "the peer listens to it, and only names below " + link_.names.prefix() +
                    " (`prefix` of this side) can be exported"},
               Waiting::kPeer);
  const auto& topics = side_.graph.topics();
  for (auto it = topics.lower_bound({heard.first, ""});
       it != topics.end() && it->first.first == heard.first; ++it) {
    if (!is_published(it->second)) continue;
    return add({InterfaceKind::kTopic, true, heard.first, it->first.second},
               {MissingReason::kOtherType, "", "the peer subscribes to it as " + heard.second},
               Waiting::kPeer);
  }
  // The rule may be right, and the namespace wrong.
  const auto similar = published_.find({last_token(heard.first), heard.second});
  if (similar == published_.end() || !is_end_of(heard.first, similar->second)) return;
  const Wish there{InterfaceKind::kTopic, true, std::string(similar->second), heard.second};
  const auto wire_name_there = link_.names.to_wire(there.name);
  auto why = wire_name_there ? forbidden(there, *wire_name_there) : std::nullopt;
  if (!why) return;
  why->text += "; the peer subscribes to " + heard.first;
  add(there, *std::move(why), Waiting::kPeer);
}

// Channels that do not reach everybody.
void Search::channels() {
  for (const ChannelFacts& channel : picture_.channels) {
    const Wish wish{channel.kind, channel.exported, channel.name, channel.type};
    if (!may_be_wished(wish.kind, wish.name, wish.type)) continue;
    const Ending& declined = channel.declined;
    if (!declined.reason.empty())
      add(wish,
          {MissingReason::kDeclined, channel.rule, "the peer declines it: " + declined.reason,
           declined.code},
          Waiting::kNobody);
    if (!channel.misfit.empty()) {
      const PolicyWords words = words_of_policy(channel.misfit);
      add(wish,
          {MissingReason::kQos, channel.rule,
           "a subscriber here gets nothing: " + std::string(words.requested) + " is requested, " +
               std::string(words.offered) + " is offered"},
          Waiting::kHere);
    }
    if (channel.lost_until > picture_.at)
      add(wish,
          {MissingReason::kLost, channel.rule,
           "many of its messages are lost in the middleware here before the bridge gets them"},
          Waiting::kPeer);
  }
}

// Declines of this side, also where nobody here can ask: a type that is not installed has no
// subscriber.
void Search::declines() {
  for (const auto& [number, offer] : link_.declined()) {
    const auto& [name, type] = offer.key;
    const Wish wish{offer.kind, false, name, type};
    if (offer.kind != InterfaceKind::kOther && is_canonical_name(name) && is_type_name(type) &&
        may_be_wished(wish.kind, name, type))
      add(declined_, wish,
          {MissingReason::kDeclined, "", "declined here: " + offer.why.reason, offer.why.code},
          Waiting::kNobody);
  }
}

MissingFound Search::take() {
  auto& names = found_.names;
  if (lonely_.size() <= kLonelyMax) {
    names.insert(names.end(), lonely_.begin(), lonely_.end());
  } else {
    found_.further += lonely_.size();
  }
  names.insert(names.end(), declined_.begin(), declined_.end());
  if (names.size() > MissingName::kMissingMax) {
    found_.further += names.size() - MissingName::kMissingMax;
    names.resize(MissingName::kMissingMax);
  }
  return std::move(found_);
}

}  // namespace

std::vector<Wish> wishes_of(const GraphView& graph, const Claims& claims, bool is_operator) {
  std::vector<Wish> imports, exports;
  for (const auto& [key, topic] : graph.topics()) {
    // Every node publishes it, so its subscriber may want that of this graph or that of the peer.
    if (key.first == kRosout && is_operator && !topic.subscribers.empty())
      imports.push_back({InterfaceKind::kTopic, false, key.first, key.second});
    if (!may_be_wished(InterfaceKind::kTopic, key.first, key.second)) continue;
    if (topic.publishers.empty() && !graph.is_brought(key) && imports.size() < kWishesMax)
      imports.push_back({InterfaceKind::kTopic, false, key.first, key.second});
    if (topic.subscribers.empty() && !is_hidden(key.first) && exports.size() < kWishesMax)
      exports.push_back({InterfaceKind::kTopic, true, key.first, key.second});
  }
  for (const auto& [name, type] : graph.called()) {
    if (imports.size() >= 2 * kWishesMax) break;
    if (may_be_wished(InterfaceKind::kService, name, type) && !graph.has_server(name) &&
        !claims.serves(service_gid(name)))
      imports.push_back({InterfaceKind::kService, false, name, type});
  }
  imports.insert(imports.end(), exports.begin(), exports.end());
  return imports;
}

MissingFound find_missing(const std::vector<Wish>& wishes, const SideView& side, const Link& link,
                          const LinkPicture& picture) {
  Search search(side, link, picture);
  search.channels();
  for (const TopicKey& heard : picture.heard) search.export_heard(heard);
  for (const Wish& wish : wishes) wish.exported ? search.export_lonely(wish) : search.import(wish);
  search.declines();
  return search.take();
}

// The rules come first: of what the peer may not have it does not learn whether it is here.
std::string_view answer_to(const SideView& side, const Link& link, const AskedName& asked) {
  const bool is_topic = asked.kind == InterfaceKind::kTopic;
  if (!is_topic && asked.kind != InterfaceKind::kService) return "unsupported";
  const std::string local = link.names.to_local(asked.name);
  if (!is_canonical_name(asked.name) || link.names.to_wire(local) != asked.name)
    return "not_permitted";
  const auto part = part_of_action(asked.kind, asked.name, asked.type);
  const auto may_have = [&](const std::string& type) {
    const Interface what{asked.kind, asked.name, type,
                         part ? part->action_type : std::string_view{}};
    return export_right(side, link, what).is_allowed_here();
  };
  if (!may_have(asked.type)) return "not_permitted";  // mutant: answers_forbidden
  bool other_type = false;
  const auto look = [&](const auto& all, auto&& exists) -> std::string_view {
    for (auto it = all.lower_bound({local, ""}); it != all.end() && it->first.first == local;
         ++it) {
      if (!exists(it->second)) continue;
      if (it->first.second != asked.type) {
        other_type = other_type || may_have(it->first.second);
        continue;
      }
      if (it->second.lack) return "type_unknown";
      return side.actions.type_of(asked.kind, local, asked.type) ? "there" : "absent";
    }
    return other_type ? "other_type" : "absent";
  };
  if (is_topic)
    return look(side.graph.topics(), [](const auto& topic) { return !topic.publishers.empty(); });
  return look(side.graph.services(),
              [&](const auto&) { return !side.claims.serves(service_gid(local)); });
}

std::optional<AskedName> question_of(const SideView& side, const Link& link, const Wish& wish) {
  auto wire_name = link.names.to_wire(wish.name);
  if (!wire_name) return std::nullopt;
  const Interface what{wish.kind, *wire_name, wish.type, action_type_of(wish)};
  if (!side.policy.decide(Direction::kImport, what, link.login.identity())) return std::nullopt;
  return AskedName{wish.kind, *std::move(wire_name), wish.type};
}

}  // namespace connect_bridge
