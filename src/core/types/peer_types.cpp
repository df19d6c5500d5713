#include "core/types/peer_types.hpp"

#include "core/types/type_description.hpp"

// A description that something needs is in one of these states: known (`text`); asked for, from one
// link (`asked`); in the line of a link that has enough questions open (`turn`); or left alone,
// until a peer that did not know it may be asked again (`next`), or a channel with that type is
// offered. ask() is called whenever that may change, and moves it on. A peer that lies about a type
// ends its own connection, as the text has not the hash; one that is silent is passed over after
// kPatience.
namespace connect_bridge {
namespace {

// What an entry takes: the text, the fields that the gateway makes of it, and the rest.
std::uint64_t cost_of(const std::string& text) {
  return 4 * text.size() + 512;
}

}  // namespace

// ---- who offers them

void PeerTypes::add(Link& link, ChannelId channel, const Definition& name) {
  if (name.second.empty()) return;
  PeerType& type = types_[name];
  Source& source = type.sources[link.id];
  source.link = &link;
  source.channels.insert(channel);
  if (wants(name, type)) ask(name, type);
}

void PeerTypes::remove(Link& link, ChannelId channel, const Definition& name) {
  const auto at = types_.find(name);
  if (at == types_.end()) return;
  PeerType& type = at->second;
  const auto questions = questions_.find(link.id);
  if (questions != questions_.end() && questions->second.open.contains(channel)) {
    // The answer still comes, but for a channel that the peer has withdrawn.
    if (link.expects(channel)) {
      questions->second.open[channel].reset();
    } else {
      questions->second.open.erase(channel);
    }
  }
  if (type.asked == std::pair{link.id, channel}) type.asked.reset();
  const auto source = type.sources.find(link.id);
  if (source == type.sources.end() || source->second.channels.erase(channel) == 0)
    return;  // it went with the connection
  // The last channel of the link with this type: it cannot be asked any longer, and what it gave
  // counts for another link that offers the same.
  if (source->second.channels.empty()) {
    if (type.turn && type.turn->first == link.id) leave_line(type);
    type.sources.erase(source);
    if (type.holder == link.id) hold(type);
  }
  if (type.sources.empty()) {
    mismatches_.on_gone(name);
    calls_.on_there(name, {});
    drop_unused(at);
  } else if (wants(name, type)) {
    ask(name, type);
  }
  if (!link.expects(channel)) ask_next(link);
}

void PeerTypes::on_link_lost(const Link& link) {
  // No answer comes any more; on another connection the channels have other numbers.
  questions_.erase(link.id);
  for (auto it = types_.begin(); it != types_.end();) {
    const auto at = it++;
    auto& [name, type] = *at;
    if (type.sources.erase(link.id) == 0) continue;
    if (type.asked && type.asked->first == link.id) type.asked.reset();
    if (type.turn && type.turn->first == link.id) type.turn.reset();
    if (type.holder == link.id) hold(type);
    if (type.sources.empty()) {
      type.next.cancel();
      drop_unused(at);
    } else if (wants(name, type)) {
      ask(name, type);
    }
  }
}

// Its mirrors are about to end, too.
void PeerTypes::on_link_dead(LinkId link) {
  for (auto& [name, type] : types_) {
    if (type.holder != link) continue;
    type.text.clear();
    type.text.shrink_to_fit();
    type.bytes.release();
    type.holder = {};
  }
}

void PeerTypes::drop_unused(Types::iterator type) {
  if (!type->second.sources.empty() || type->second.users > 0) return;
  leave_line(type->second);
  types_.erase(type);
}

// ---- who needs them

bool PeerTypes::wants(const Definition& name, const PeerType& type) const {
  return type.users > 0 || mismatches_.waits_for(name) || calls_.waits_for(name);
}

void PeerTypes::need(const Definition& name, TypeUser mirror, const std::string& node) {
  if (!users_.try_emplace(mirror, User{name, node}).second) return;
  nodes_changed_ |= ++nodes_[node] == 1;
  PeerType& type = types_[name];
  const bool is_first = ++type.users == 1;
  if (type.text.empty()) return ask(name, type);
  if (is_first) outputs_.push(DescribeType{name.first, name.second, type.text});
}

void PeerTypes::release(TypeUser mirror) {
  const auto user = users_.extract(mirror);
  if (!user) return;
  const auto node = nodes_.find(user.mapped().node);
  if (--node->second == 0) {
    nodes_.erase(node);
    nodes_changed_ = true;
  }
  const auto type = types_.find(user.mapped().type);
  --type->second.users;
  drop_unused(type);
}

void PeerTypes::tell(const Definition& name, const std::string& text) {
  mismatches_.on_there(name, text);
  calls_.on_there(name, text);
}

void PeerTypes::on_looked_up(const TypeLookedUp& found) {
  mismatches_.on_looked_up(found);
  const auto name = calls_.on_looked_up(found);
  if (!name) return;
  const auto at = types_.find(*name);
  if (at == types_.end()) return calls_.on_there(*name, {});
  if (!at->second.text.empty()) return calls_.on_there(*name, at->second.text);
  ask(*name, at->second);
}

void PeerTypes::explain(Mismatch mismatch, const Now& now) {
  const Definition name = mismatch.there;
  if (!mismatches_.begin(std::move(mismatch), now)) return;
  const auto at = types_.find(name);
  if (at == types_.end()) return mismatches_.on_there(name, {});
  if (!at->second.text.empty()) return mismatches_.on_there(name, at->second.text);
  ask(name, at->second);
}

// ---- questions and answers

void PeerTypes::forget_withdrawn(const Link& link, Questions& questions) {
  std::erase_if(questions.open,
                [&](const auto& entry) { return !entry.second && !link.expects(entry.first); });
}

void PeerTypes::ask(const Definition& name, PeerType& type) {
  if (type.asked || !type.text.empty()) return;
  type.next.cancel();
  if (type.unusable || !wants(name, type)) {
    leave_line(type);
    return tell(name, {});
  }
  const Choice choice = choose(type);
  if (choice.free) return ask(name, type, *choice.free);
  if (choice.full) return queue(name, type, *choice.full);
  tell(name, {});
  if (type.users > 0 && choice.again) type.next = timers_.set(*choice.again, name);
}

// One peer is asked at a time, because any of them gives the same text: the first that was not
// asked lately and has room for a question. If all that may be asked have enough questions open,
// the type waits in the line of the first; if all were asked lately, until one may be asked again.
// After kPatience the next is asked, so a peer that does not answer keeps no type from the others.
PeerTypes::Choice PeerTypes::choose(PeerType& type) {
  Choice choice;
  for (auto& [link, source] : type.sources) {
    Questions& questions = questions_[link];
    if (source.asks >= kAsksMax || questions.open.contains(source.channel())) continue;
    if (source.again > now_) {
      choice.again = earliest(choice.again, source.again);
      continue;
    }
    forget_withdrawn(*source.link, questions);
    if (questions.open.size() < kDescribesMax) {
      choice.free = &source;
      break;
    }
    if (!choice.full) choice.full = source.link;
  }
  return choice;
}

void PeerTypes::ask(const Definition& name, PeerType& type, Source& source) {
  const ChannelId channel = source.channel();
  leave_line(type);
  ++source.asks;
  source.again = now_ + kAskAgain;
  type.asked = {source.link->id, channel};
  type.next = timers_.set(now_ + kPatience, name);
  questions_[source.link->id].open[channel] = name;
  source.link->send(Describe{{channel}});
}

void PeerTypes::queue(const Definition& name, PeerType& type, const Link& link) {
  type.next = timers_.set(now_ + kPatience, name);
  if (type.turn) return;
  type.turn = {link.id, ++last_turn_};
  questions_[link.id].waiting[last_turn_] = name;
}

void PeerTypes::leave_line(PeerType& type) {
  if (!type.turn) return;
  const auto line = questions_.find(type.turn->first);
  if (line != questions_.end()) line->second.waiting.erase(type.turn->second);
  type.turn.reset();
}

void PeerTypes::ask_next(Link& link) {
  const auto found = questions_.find(link.id);
  if (found == questions_.end()) return;
  Questions& questions = found->second;
  forget_withdrawn(link, questions);
  while (!questions.waiting.empty() && questions.open.size() < kDescribesMax) {
    const Definition name = questions.waiting.begin()->second;
    PeerType& type = types_.at(name);
    leave_line(type);
    ask(name, type);
  }
}

// The answer may come still, and is taken then.
void PeerTypes::on_time(const Now& now) {
  mismatches_.on_time(now);
  calls_.on_time(now);
  while (const auto name = timers_.take_due(now.steady)) {
    PeerType& type = types_.at(*name);
    type.next.cancel();
    type.asked.reset();
    ask(*name, type);
  }
}

Result<Nothing> PeerTypes::on_description(Link& link, const Description& description) {
  if (!link.expects(description.channel))
    return Error{CloseCode::kUnknownChannel, "the description of a channel that does not exist"};
  Questions& questions = questions_[link.id];
  const auto question = questions.open.find(description.channel);
  if (question == questions.open.end())
    return Error{CloseCode::kIllegal, "a description that was not asked for"};
  // It may come after kPatience, when another peer was asked: it is checked and taken all the same.
  // Without a name this side has given up the channel, and the answer with it.
  const std::optional<Definition> name = std::move(question->second);
  questions.open.erase(question);
  const auto at = name ? types_.find(*name) : types_.end();
  if (at != types_.end()) {
    PeerType& type = at->second;
    if (type.asked == std::pair{link.id, description.channel}) type.asked.reset();
    if (!description.text.empty()) {
      if (type_hash_of(description.text) != name->second)
        return Error{CloseCode::kMalformed, "a description that does not have the type's hash"};
      keep(*name, type, link, description.text);
    }
    if (type.text.empty()) ask(*name, type);  // another link
  }
  ask_next(link);
  return Nothing{};
}

// What is right but beyond the limits here is as good as not known.
void PeerTypes::keep(const Definition& name, PeerType& type, Link& link, const std::string& text) {
  const auto read = parse_description(text);
  // It has the hash, so every other peer would give the same text: none is asked again.
  type.unusable = !read || read.value().type.name != name.first;
  if (type.unusable) return;
  if (cost_of(text) > link.memory.room()) return;
  type.text = text;
  type.asked.reset();
  type.next.cancel();
  leave_line(type);
  type.holder = link.id;
  type.bytes = link.memory.hold(cost_of(text));
  if (type.users > 0) outputs_.push(DescribeType{name.first, name.second, text});
  tell(name, text);
}

// The link that gave it does not offer it any longer: it counts for one that does, if there is one.
void PeerTypes::hold(PeerType& type) {
  if (type.sources.empty()) return;
  Link& link = *type.sources.begin()->second.link;
  type.holder = link.id;
  type.bytes = link.memory.hold(cost_of(type.text));
}

}  // namespace connect_bridge
