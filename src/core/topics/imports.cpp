// Channels offered to us and what is demanded of them. Mirrors are in imports_mirrors.cpp, the way
// of a message is in imports_data.cpp.
#include "core/topics/imports.hpp"

#include <algorithm>

#include "core/link/options.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {

Imports::Imports(const SideOptions& options, const Policy& policy, const GraphView& graph,
                 const Claims& claims, LinkTable& links, Outputs& outputs)
    : options_(options),
      policy_(policy),
      graph_(graph),
      claims_(claims),
      links_(links),
      outputs_(outputs) {}

void Imports::on_offer(Link& link, const ChannelOffer& offer, const Now& now) {
  const ChannelKey key{link.id, offer.channel};
  Channel& channel = channels_[key];
  channel.declined = true;  // until all is found in order; a declined channel's data is dropped
  if (offer.kind != InterfaceKind::kTopic)
    return decline(link, offer.channel, "unsupported", "such channels are not forwarded");
  if (!is_canonical_name(offer.name) || !is_topic_type(offer.type))
    return decline(link, offer.channel, "not_permitted", "the name or type is not canonical");
  auto decision = permission(link, offer.name, offer.type, offer.action_type);
  if (!decision)
    return decline(link, offer.channel, "not_permitted", "no rule allows importing " + offer.name);
  if (options_.names.to_wire(options_.names.to_local(offer.name)) != offer.name)
    return decline(link, offer.channel, "not_permitted", "another name is mapped to its name here");
  channel.declined = false;
  channel.key = {options_.names.to_local(offer.name), offer.type};
  channel.type_hash = offer.type_hash;
  channel.action_type = offer.action_type;
  channel.decision = std::move(*decision);
  channel.newest_only = offer.newest_only;
  for (const auto& origin : offer.origins) add_origin(key, channel, origin, now);
}

Result<Nothing> Imports::on_origins(Link& link, const OriginsChanged& change, const Now& now) {
  const ChannelKey key{link.id, change.channel};
  const auto it = channels_.find(key);
  if (it == channels_.end())
    return Error{CloseCode::kUnknownChannel, "origins of a channel that does not exist"};
  Channel& channel = it->second;
  if (channel.declined) return Nothing{};
  // First, so that a peer can replace all of a channel's publishers in one message.
  for (const OriginId id : change.removed) {
    const auto origin = channel.origins.find(id);
    if (origin == channel.origins.end()) continue;
    Mirror& mirror = *origin->second;
    channel.origins.erase(origin);
    remove_candidate(mirror, link.id, now);
  }
  const auto fresh =
      std::count_if(change.added.begin(), change.added.end(),
                    [&](const OriginOffer& o) { return !channel.origins.contains(o.origin); });
  if (channel.origins.size() + static_cast<std::size_t>(fresh) > kChannelOriginsMax)
    return Error{CloseCode::kTooLarge, "more origins on a channel than this side accepts"};
  for (const auto& origin : change.added) add_origin(key, channel, origin, now);
  return Nothing{};
}

bool Imports::on_withdraw(Link& link, ChannelId channel, const Now& now) {
  if (!channels_.contains({link.id, channel})) return false;
  end_channel({link.id, channel}, false, now);
  return true;
}

void Imports::end_channel(const ChannelKey& key, bool keep_candidates, const Now& now) {
  const auto it = channels_.find(key);
  Channel& channel = it->second;
  for (const auto& message : channel.decoding) count_decoding(key.first, message, false);
  if (channel.job) jobs_.erase(channel.job);
  auto origins = std::move(channel.origins);
  channels_.erase(it);
  for (const auto& [id, mirror] : origins) {
    if (!keep_candidates) {
      remove_candidate(*mirror, key.first, now);
      continue;
    }
    for (auto& candidate : mirror->candidates)
      if (candidate.link == key.first) candidate.channel = {};
    update_mirror(*mirror, now);
  }
}

void Imports::update_demands(const Mirror& mirror, const Now& now) {
  for (const auto& candidate : mirror.candidates)
    if (candidate.channel) update_demand({candidate.link, candidate.channel}, now);
}

bool Imports::wanted(const ChannelKey& key, const Channel& channel, const Now& now) const {
  if (channel.declined) return false;
  const TopicState* topic = graph_.find(channel.key);
  const bool listened = topic && !topic->subscribers.empty();
  return std::any_of(channel.origins.begin(), channel.origins.end(), [&](const auto& origin) {
    const Mirror& mirror = *origin.second;
    const Candidate& feeder = mirror.candidates.front();
    const bool expected = mirror.demanded_until && *mirror.demanded_until > now.steady;
    return (listened || expected) && mirror.id && feeder.link == key.first &&
           feeder.channel == key.second && (!mirror.settles_at || *mirror.settles_at <= now.steady);
  });
}

void Imports::update_demand(const ChannelKey& key, const Now& now) {
  const auto it = channels_.find(key);
  if (it == channels_.end()) return;
  const bool on = wanted(key, it->second, now);
  if (on == it->second.demanded) return;
  it->second.demanded = on;
  auto& [wants, ends] = demands_[key.first];
  auto& now_in = on ? wants : ends;
  auto& before_in = on ? ends : wants;
  now_in.on = on;
  if (std::erase(before_in.channels, key.second) == 0) now_in.channels.push_back(key.second);
}

void Imports::send_demands() {
  if (demands_.empty()) return;
  for (auto& [id, changes] : demands_) {
    const auto link = links_.find(id);
    if (link == links_.end()) continue;
    for (auto* change : {&changes.first, &changes.second})
      if (!change->channels.empty()) link->second.send(*change);
  }
  demands_.clear();
}

void Imports::on_graph(const Now& now) {
  if (!graph_since_) graph_since_ = now.steady;
  for (auto& [key, mirror] : mirrors_) {
    update_mirror(mirror, now);
    warn_incompatible(mirror);
  }
}

void Imports::on_claims(const Now& now) {
  for (auto& [key, mirror] : mirrors_) update_mirror(mirror, now);
}

void Imports::decline(Link& link, ChannelId id, const std::string& code,
                      const std::string& reason) {
  channels_[{link.id, id}].declined = true;
  link.send(Decline{id, code, reason});
}

void Imports::on_link_lost(LinkId link, const Now& now) {
  for (auto it = channels_.lower_bound({link, ChannelId{}});
       it != channels_.end() && it->first.first == link;) {
    const ChannelKey key = (it++)->first;
    end_channel(key, true, now);
  }
  demands_.erase(link);
}

void Imports::on_policy(const Now& now) {
  for (auto& [key, channel] : channels_) {
    Link& link = links_.at(key.first);
    if (channel.declined) continue;
    const auto decision = permission(link, channel.key, channel.action_type);
    if (decision) {
      channel.decision = *decision;
      end_withheld(link, channel, now);
      continue;
    }
    auto origins = std::move(channel.origins);
    channel.origins.clear();
    update_demand(key, now);
    decline(link, key.second, "not_permitted", "no rule allows importing it any longer");
    for (const auto& [id, mirror] : origins) remove_candidate(*mirror, key.first, now);
  }
  for (auto& [key, channel] : channels_) renew(key, channel, now);
  for (auto it = mirrors_.begin(); it != mirrors_.end();) {
    Mirror& mirror = (it++)->second;
    const auto candidates = mirror.candidates;  // the last one takes an unmade mirror with it
    for (const auto& candidate : candidates)
      if (!candidate.channel &&
          !permission(links_.at(candidate.link), mirror.key.first, mirror.action_type))
        remove_candidate(mirror, candidate.link, now);
  }
}

std::optional<Decision> Imports::permission(const Link& link, const std::string& name,
                                            const std::string& type,
                                            const std::string& action_type) const {
  if (is_parameter_events(InterfaceKind::kTopic, name))
    return policy_.decide_parameter_events(link.identity);
  return policy_.decide(Direction::kImport, {InterfaceKind::kTopic, name, type, action_type},
                        link.identity);
}

std::optional<Decision> Imports::permission(const Link& link, const TopicKey& key,
                                            const std::string& action_type) const {
  const auto wire_name = options_.names.to_wire(key.first);
  if (!wire_name) return std::nullopt;
  return permission(link, *wire_name, key.second, action_type);
}

bool Imports::is_withheld(const Link& link, const Channel& channel,
                          const OriginOffer& origin) const {
  const auto wire_name = options_.names.to_wire(channel.key.first);
  if (!wire_name || !is_parameter_events(InterfaceKind::kTopic, *wire_name)) return false;
  const Interface what{InterfaceKind::kTopic, *wire_name, channel.key.second, {}, origin.node};
  return !policy_.decide(Direction::kImport, what, link.identity);
}

void Imports::end_withheld(const Link& link, Channel& channel, const Now& now) {
  if (channel.key.second != kParameterEventType) return;
  for (auto it = channel.origins.begin(); it != channel.origins.end();) {
    Mirror& mirror = *it->second;
    if (!is_withheld(link, channel, mirror.origin)) {
      ++it;
      continue;
    }
    it = channel.origins.erase(it);
    remove_candidate(mirror, link.id, now);
  }
}

}  // namespace connect_bridge
