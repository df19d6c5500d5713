#include "sim/wire_check.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <variant>

namespace connect_bridge::sim {
namespace {

// Wildcards match no hidden name, so who asks for one has named it.
bool spells_out(const Policy& policy, const std::string& name) {
  return std::any_of(policy.rules().begin(), policy.rules().end(), [&](const Rule& rule) {
    const auto& imports = rule.opens[Direction::kImport].values;
    return std::any_of(imports.begin(), imports.end(), [&](const auto& patterns) {
      return std::any_of(patterns.begin(), patterns.end(),
                         [&](const Pattern& pattern) { return pattern.matches(name); });
    });
  });
}

using namespace std::chrono_literals;

// Larger messages may legitimately wait for a worker or for the window.
constexpr std::size_t kSmallMessageBytes = 2048;
constexpr Duration kTakenKept = 20s;

std::string_view text_of(ByteView bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// The identity that the host takes its peer for.
Identity identity_of(const Host& host, ConnectionId id) {
  const Identity* who = host.identity_on(id);
  return who == nullptr ? Identity{} : *who;
}

}  // namespace

void WireCheck::on_connection(const Host& host, ConnectionId id) {
  Connection& connection = connections_[{host.index(), id}];
  connection.records_left = host.is_server() ? 1 : 2;
  connection.path = network_.path_of(host, id);
  connection.opened = ledger_.now();
}

void WireCheck::on_disconnected(const Host& host, ConnectionId id) {
  connections_.erase({host.index(), id});
}

void WireCheck::on_end(const Host& host) {
  std::erase_if(connections_, [&](const auto& c) { return c.first.first == host.index(); });
}

// ---- what a side sends
// ---------------------------------------------------------------------------

void WireCheck::on_sent(const Host& host, ConnectionId id, const FlatPacket& packet) {
  const auto it = connections_.find({host.index(), id});
  if (it == connections_.end()) violated(describe(host) + " sends on a closed connection");
  Connection& connection = it->second;
  if (connection.records_left > 0) {
    if (packet.text) violated(describe(host) + " sends a text before its login records");
    --connection.records_left;
    return;
  }
  check_expiry(host, id);
  if (packet.text) {
    check_cap(host, connection, packet.bytes.size(), false);
    connection.first_bytes += packet.bytes.size();
    on_text(host, id, connection, text_of(packet.bytes));
    return;
  }
  const std::uint64_t weighted = connection.weighted_bytes;
  FrameReader reader(packet.bytes);
  for (;;) {
    const auto next = reader.next();
    if (!next) violated(describe(host) + " sends a bad frame: " + next.error().message);
    if (!next.value()) break;
    ++frames_;
    if (const auto* message = std::get_if<MessageFrame>(&*next.value())) {
      on_message(host, id, connection, *message);
    } else if (const auto* part = std::get_if<PartFrame>(&*next.value())) {
      on_part(host, connection, *part);
    } else if (const auto* texts = std::get_if<TextsFrame>(&*next.value())) {
      connection.first_bytes += packet.bytes.size();
      const auto read = connection.sent_texts.read(*texts, kept_[host.index()]);
      if (read.empty()) violated(describe(host) + " sends texts that do not decompress");
      for (const auto& text : read) on_text(host, id, connection, text);
    } else {
      connection.first_bytes += kTimeReplyBytes;
    }
  }
  check_cap(host, connection, packet.bytes.size(), connection.weighted_bytes > weighted);
}

void WireCheck::on_text(const Host& host, ConnectionId id, Connection& connection,
                        std::string_view text) {
  const auto control = decode_control(text);
  if (!control) violated(describe(host) + " sends a bad control text: " + control.error().message);
  connection.sent_texts.note(control.value(), kept_[host.index()]);
  on_control(host, identity_of(host, id), connection, control.value());
}

// Data that may be held back leaves only while the cap has room for it, counting all that has left
// within a second.
void WireCheck::check_cap(const Host& host, Connection& connection, std::size_t bytes, bool held) {
  const std::uint64_t cap = host.plan().options.outbox.bytes_per_second_max;
  if (cap == 0) return;
  auto& second = connection.second;
  for (; !second.empty() && second.front().first + 1s <= ledger_.now(); second.pop_front())
    connection.second_bytes -= second.front().second;
  held =
      held && ledger_.policies_of(host) == 1;  // else it may have been urgent when it was offered
  if (held) ledger_.coverage().count(Judged::kMetered);
  const std::uint64_t burst = cap / 10;
  if (held && connection.second_bytes > cap + burst)
    violated(describe(host) + " sends more after " + std::to_string(connection.second_bytes) +
             " bytes in a second, beyond its cap of " + std::to_string(cap));
  second.push_back({ledger_.now(), bytes});
  connection.second_bytes += bytes;
}

void WireCheck::check_expiry(const Host& host, ConnectionId id) const {
  const Identity* who = host.identity_on(id);
  if (who == nullptr || who->expires == 0) return;
  // It is noticed when the side is next called, with the next question for the peer's clock.
  const Duration notice = host.plan().options.dead_after / 3 + 100ms;
  if (ledger_.was_clock_stepped_since(ledger_.now() - notice)) return;  // it expired by this
  if (host.now().system > who->expires + notice.count()) {
    violated(describe(host) + " still sends to " + who->name + ", whose login has expired");
  }
}

void WireCheck::on_control(const Host& host, const Identity& who, Connection& connection,
                           const Control& control) {
  if (const auto* offer = std::get_if<Offer>(&control)) {
    for (const auto& channel : offer->channels) on_offer(host, who, connection, channel);
  } else if (const auto* change = std::get_if<OriginsChanged>(&control)) {
    const auto it = connection.channels.find(change->channel);
    if (it == connection.channels.end()) violated("origins of a channel that was not offered");
    for (const OriginId gone : change->removed) {
      it->second.origins.erase(gone);
    }
    for (const auto& origin : change->added) {
      it->second.origins[origin.origin] = Origin{origin.gid, origin.qos, ledger_.now()};
    }
  } else if (const auto* withdraw = std::get_if<Withdraw>(&control)) {
    for (const ChannelId gone : withdraw->channels) {
      if (connection.channels.erase(gone) == 0) violated("a channel is withdrawn twice");
      std::erase_if(connection.requests, [&](const auto& r) { return r.second == gone; });
    }
  } else if (const auto* attach = std::get_if<Attach>(&control)) {
    on_attach(host, who, connection, *attach);
  } else if (const auto* ask = std::get_if<Ask>(&control)) {
    for (const auto& asked : ask->names)
      if (asked.name.find("/_") != std::string::npos && !has_action_token(asked.name) &&
          !spells_out(host.policy(), asked.name))
        violated(describe(host) + " asks for the hidden name " + asked.name);
  }
}

// Its requests may be sent once the peer has answered.
void WireCheck::on_attach(const Host& host, const Identity& who, Connection& connection,
                          const Attach& attach) {
  if (connection.channels.contains(attach.requests)) {
    violated(describe(host) + " uses a channel number twice");
  }
  if (!connection.requests.try_emplace(attach.channel, attach.requests).second) {
    violated(describe(host) + " attaches twice");
  }
  Channel& channel = connection.channels[attach.requests];
  channel.wire = "requests of channel " + std::to_string(attach.channel.value);
  channel.kind = InterfaceKind::kService;
  channel.requests = true;
  const auto& [name, type] = connection.services[attach.channel];
  const auto how = service_treatment_of(host.policy(), Direction::kImport, name, type, who);
  channel.priority = how && how->priority ? *how->priority : Priority::kHigh;
}

void WireCheck::on_offer(const Host& host, const Identity& who, Connection& connection,
                         const ChannelOffer& offer) {
  const std::string local = host.plan().names.to_local(offer.name);
  if (is_claims(offer.name) || is_claims(local)) violated("the bridges' own topic is offered");
  if (connection.channels.contains(offer.channel)) violated("a channel is offered twice");
  // A rule may have changed while the offer waited behind other texts.
  if (!ledger_.was_permitted(host, ledger_.now() - 5s, Direction::kExport, offer.kind, offer.name,
                             offer.type, who)) {
    violated(describe(host) + " offers " + offer.name + " without a right");
  }
  Channel& channel = connection.channels[offer.channel];
  if (offer.kind == InterfaceKind::kService && offer.epoch == 0) violated("an epoch of 0");
  channel.wire = offer.name;
  channel.kind = offer.kind;
  channel.resume = offer.resume;
  channel.local = local;
  channel.type = offer.type;
  channel.priority = offer.priority;
  for (const auto& origin : offer.origins) {
    channel.origins[origin.origin] = Origin{origin.gid, origin.qos, ledger_.now()};
  }
}

void WireCheck::count(Connection& connection, Channel& channel, std::size_t bytes) {
  if (channel.priority == Priority::kUrgent) {
    connection.first_bytes += bytes;
  } else {
    connection.weighted_bytes += bytes;
    connection.class_bytes[channel.priority] += bytes;
  }
  begin_wait(connection, channel);
}

void WireCheck::on_message(const Host& host, ConnectionId id, Connection& connection,
                           const MessageFrame& frame) {
  const auto it = connection.channels.find(frame.channel);
  if (it == connection.channels.end()) {
    violated(describe(host) + " sends data of a channel that it does not offer");
  }
  Channel& channel = it->second;
  const std::string what = describe(host) + " sends a message of " + channel.wire;
  if (!channel.demanded) violated(what + " that nobody demands");
  if (frame.demand != channel.demand) violated(what + " for another demand");
  if (channel.open_bytes > 0) violated(what + " inside another one");
  // Over a break the numbers go on, and what was begun before it and is too old by now leaves a
  // gap.
  std::uint32_t& sequence = connection.sequences[frame.channel];
  if (channel.resume ? frame.sequence <= sequence : frame.sequence != sequence + 1)
    violated(what + " out of sequence");
  sequence = frame.sequence;
  if (channel.kind == InterfaceKind::kTopic) {
    check_age(host, identity_of(host, id), channel, frame);
    if (channel.priority == Priority::kUrgent) check_urgent(host, id, connection, channel, frame);
  } else if (channel.requests) {
    std::uint32_t& last = connection.calls[frame.channel];
    if (frame.subject.value <= last) violated(what + " whose call does not rise");
    last = frame.subject.value;
  }
  channel.open_bytes = frame.body_bytes - frame.part.size();
  count(connection, channel, frame.part.size() + kMessageHeaderBytes);
  ++sent_[{host.index(), channel.wire}];
}

void WireCheck::on_part(const Host& host, Connection& connection, const PartFrame& frame) {
  const auto it = connection.channels.find(frame.channel);
  if (it == connection.channels.end()) {
    violated(describe(host) + " sends a part for a channel that it does not offer");
  }
  Channel& channel = it->second;
  if (channel.open_bytes < frame.part.size() || (channel.open_bytes == 0 && !frame.abort)) {
    violated(describe(host) + " sends a part that belongs to no message of " + channel.wire);
  }
  channel.open_bytes = frame.abort ? 0 : channel.open_bytes - frame.part.size();
  if (frame.abort) return;
  count(connection, channel, frame.part.size() + kPartHeaderBytes);
}

// What is older than its publisher's lifespan or the exporter's max_age is not begun to be sent.
void WireCheck::check_age(const Host& host, const Identity& who, const Channel& channel,
                          const MessageFrame& frame) const {
  if (frame.stamp == 0) return;
  const Duration age{host.now().system - frame.stamp};
  const std::string what = describe(host) + " sends a message of " + channel.wire + " that is " +
                           std::to_string(seconds(age)) + " s old, beyond its ";
  // The origins of a channel share its queue, and with it the longest of their lifespans.
  Duration lifespan{};
  for (const auto& [id, origin] : channel.origins)
    lifespan = std::max(lifespan, origin.qos.lifespan);
  if (lifespan != kForever) ledger_.coverage().count(Judged::kAges);
  if (lifespan != kForever && age > lifespan) violated(what + "lifespan");
  const auto treatment =
      treatment_of(host.policy(), Direction::kExport, channel.wire, channel.type, who);
  if (treatment && treatment->max_age != kForever && age > treatment->max_age) {
    violated(what + "max_age");
  }
}

// Between the taking of an urgent message and its sending nothing else may be begun, and it must
// not wait longer than what lies before it in the network's buffers takes on a path that is well.
void WireCheck::check_urgent(const Host& host, ConnectionId id, const Connection& connection,
                             const Channel& channel, const MessageFrame& frame) {
  if (ledger_.policies_of(host) > 1) return;  // what is urgent now may not have been before
  const auto offered = channel.origins.find(frame.subject.origin());
  if (offered == channel.origins.end()) return;
  const Origin& origin = offered->second;
  const auto it = taken_.find({host.index(), {origin.gid, frame.stamp}});
  if (it == taken_.end() || origin.offered >= it->second.at) return;
  if (!channel.demanded || channel.demanded_since >= it->second.at) return;
  const auto before = it->second.bytes.find(id);
  if (before == it->second.bytes.end()) return;
  const auto treatment = treatment_of(host.policy(), Direction::kExport, channel.wire, channel.type,
                                      identity_of(host, id));
  // A rate may have held it back: the last message of a publisher leaves later.
  if (treatment && (treatment->max_rate > 0 || treatment->bytes_per_second_max > 0)) return;
  ledger_.coverage().count(Judged::kUrgent);
  const auto weighted = connection.weighted_bytes - before->second.first;
  if (weighted > 0)
    violated(describe(host) + " sent " + std::to_string(weighted) +
             " bytes of lower classes before an urgent message of " + channel.wire);
  const TimePoint taken = it->second.at;
  const Path& path = network_.path(connection.path);
  if (path.plan.loss_permille > 0) return;  // it may wait for what is sent again
  if (std::max(path.disturbed_until, connection.opened) + 5s > taken) return;
  const auto& outbox = host.plan().options.outbox;
  const std::uint64_t ahead = 2 * (path.plan.send_buffer + path.plan.relay_buffer +
                                   outbox.fragment_bytes + outbox.packet_bytes) +
                              connection.first_bytes - before->second.second;
  const Duration bound =
      Duration{static_cast<std::int64_t>(ahead * 1'000'000'000 / path.plan.rate())} +
      2 * (path.plan.one_way() + path.plan.jitter) + 120ms;
  if (ledger_.now() - taken > bound) {
    violated("an urgent message of " + channel.wire + " waits " +
             std::to_string(seconds(ledger_.now() - taken)) + " s in " + describe(host) +
             ", more than " + std::to_string(seconds(bound)) + " s");
  }
}

// ---- what a side knows
// -----------------------------------------------------------------------------

void WireCheck::on_received(const Host& host, ConnectionId id, bool text, ByteView packet) {
  const auto it = connections_.find({host.index(), id});
  if (it == connections_.end()) return;
  if (text) return on_received(host, it->second, text_of(packet));
  FrameReader reader(packet);
  for (;;) {
    const auto next = reader.next();
    if (!next || !next.value()) return;
    const auto* texts = std::get_if<TextsFrame>(&*next.value());
    if (!texts) continue;
    // Whatever a host has sent, as the host knows its peer by its own records.
    TextReader::Kept kept;
    for (const auto& [sender, all] : kept_)
      if (sender != host.index()) kept.insert(kept.end(), all.begin(), all.end());
    for (const auto& each : it->second.received_texts.read(*texts, kept))
      on_received(host, it->second, each);
  }
}

void WireCheck::on_received(const Host&, Connection& connection, std::string_view text) {
  const auto control = decode_control(text);
  if (!control) return;  // a hostile peer
  auto& channels = connection.channels;
  if (const auto* offer = std::get_if<Offer>(&control.value())) {
    for (const auto& channel : offer->channels) {
      if (channel.kind != InterfaceKind::kService) continue;
      connection.services[channel.channel] = {channel.name, channel.type};
    }
  } else if (const auto* attach = std::get_if<Attach>(&control.value())) {
    const auto channel = channels.find(attach->channel);
    if (channel != channels.end()) channel->second.demanded = true;
  } else if (const auto* attached = std::get_if<Attached>(&control.value())) {
    const auto requests = connection.requests.find(attached->channel);
    if (requests != connection.requests.end()) channels[requests->second].demanded = true;
  }
  const auto* demand = std::get_if<Demand>(&control.value());
  if (demand == nullptr) return;
  for (const auto& wanted : demand->channels) {
    const auto channel = channels.find(wanted.channel);
    if (channel == channels.end() || channel->second.kind == InterfaceKind::kService) continue;
    channel->second.demanded = wanted.number != 0;
    channel->second.demand = wanted.number;
    channel->second.demanded_since = ledger_.now();
  }
}

void WireCheck::on_taken(const Host& host, const Reader&, const Writer& writer,
                         const Sample& sample) {
  while (!taken_order_.empty() && taken_order_.front().first + kTakenKept < ledger_.now()) {
    taken_.erase(taken_order_.front().second);
    taken_order_.pop_front();
  }
  const std::size_t small =
      std::min<std::size_t>(kSmallMessageBytes, host.plan().options.compress_job_bytes);
  auto& largest = largest_[{host.graph(), writer.spec.topic}];
  largest = std::max(largest, sample.payload.size());
  if (largest >= small || writer.spec.qos.durability != Durability::kVolatile) return;
  const TakenKey key{host.index(), {writer.gid, sample.stamp}};
  Taken& taken = taken_[key];
  taken.at = ledger_.now();
  for (const auto& [id, connection] : connections_) {
    if (id.first != host.index()) continue;
    taken.bytes[id.second] = {connection.weighted_bytes, connection.first_bytes};
  }
  taken_order_.push_back({ledger_.now(), key});
}

std::uint64_t WireCheck::messages_sent(const Host& host, const std::string& wire) const {
  const auto it = sent_.find({host.index(), wire});
  return it == sent_.end() ? 0 : it->second;
}

bool WireCheck::is_demanded(const Host& host, const std::string& wire) const {
  for (const auto& [key, connection] : connections_) {
    if (key.first != host.index()) continue;
    for (const auto& [id, channel] : connection.channels) {
      if (channel.wire == wire && channel.demanded) return true;
    }
  }
  return false;
}

}  // namespace connect_bridge::sim
