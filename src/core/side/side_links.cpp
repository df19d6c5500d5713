// Connections and links: who is logged in, which connection carries which link, what a loss means.
#include <algorithm>

#include "core/side/side_state.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kPendingMax = 256;  // connections before login
// After a reconnect the peer has this long for its first round of offers.
constexpr Duration kOffersTime = std::chrono::seconds(30);
// A link that lives this long has come to something: the back-off begins anew after it.
constexpr Duration kSteadyLink = std::chrono::seconds(5);
constexpr std::size_t kPastTopicsMax = 4096;  // whose counts a lost connection leaves
constexpr Duration kClockRequestPeriod = std::chrono::milliseconds(100);

}  // namespace

LinkOptions Side::State::link_options() {
  LinkOptions o;
  o.server = options.role == Role::kServer;
  o.side = side;
  o.node = options.node;
  o.login_method = options.login_method;
  o.credential = options.credential;
  o.login_timeout = options.login_timeout;
  o.dead_after = options.dead_after;
  o.outbox = options.outbox;
  o.reassembly = options.reassembly;
  if (!o.server && !links.empty()) o.session = links.begin()->second.session;
  return o;
}

LinkEntry* Side::State::entry_of(ConnectionId connection) {
  for (auto& [id, entry] : links)
    if (entry.link && entry.link->connection() == connection) return &entry;
  return nullptr;
}

void Side::State::close(ConnectionId connection, CloseCode code, const std::string& reason) {
  outputs.push(CloseConnection{connection, code, reason});
}

void Side::State::on(ConnectionOpened& input, const Now& now) {
  if (pending.size() >= kPendingMax)
    return close(input.connection, CloseCode::kTooManyConnections,
                 "too many connections without login");
  Pending& waiting = pending[input.connection];
  waiting.link = std::make_unique<Link>(link_options(), input.connection, input.peer, now);
}

void Side::State::on(DialFailed& input, const Now& now) {
  if (input.connection != dialing) return;
  if (last_failure != input.reason)
    outputs.log(LogLevel::kWarn, "cannot connect: " + input.reason + "; trying again");
  last_failure = input.reason;
  dial_later(false, now);
}

void Side::State::on(PacketReceived& input, const Now& now) {
  if (const auto it = pending.find(input.connection); it != pending.end())
    return it->second.link->on_packet(input.text, input.payload, now, it->second.events);
  if (LinkEntry* entry = entry_of(input.connection))
    entry->link->on_packet(input.text, input.payload, now, entry->events);
}

void Side::State::on(ConnectionClosed& input, const Now& now) {
  const std::string reason = input.reason.empty() ? "the connection was closed" : input.reason;
  const bool refused = input.code == static_cast<std::uint16_t>(CloseCode::kLoginRefused);
  if (pending.erase(input.connection) > 0) {
    if (options.role == Role::kServer) return;
    if (last_failure != reason)
      outputs.log(LogLevel::kWarn, "the server closed the connection: " + reason);
    last_failure = reason;
    return dial_later(refused, now);
  }
  LinkEntry* entry = entry_of(input.connection);
  if (!entry) return;
  outputs.log(LogLevel::kWarn, "lost the link with " + entry->label() + ": " + reason);
  last_failure = reason;
  detach(*entry, left_for_good(input.code), now);
}

// A client that says goodbye needs no place any more. A server that does so is mostly restarted:
// its mirrors wait for it like after any loss.
bool Side::State::left_for_good(std::optional<std::uint16_t> code) const {
  return options.role == Role::kServer && code &&
         (*code == static_cast<std::uint16_t>(CloseCode::kNormal) ||
          *code == static_cast<std::uint16_t>(CloseCode::kGoingAway));
}

bool Side::State::handle_pending_events(const Now& now) {
  bool any = false;
  for (auto it = pending.begin(); it != pending.end();) {
    const ConnectionId connection = it->first;
    Pending& waiting = (it++)->second;
    LinkEvents events;
    events.swap(waiting.events);
    for (auto& event : events) {
      any = true;
      if (auto* asked = std::get_if<LoginAsked>(&event)) {
        outputs.push(Authenticate{connection, waiting.link->peer().address,
                                  std::move(asked->method), std::move(asked->credential)});
      } else if (auto* failed = std::get_if<LinkFailed>(&event)) {
        fail_pending(connection, failed->code, failed->reason, now);
        break;
      } else if (std::holds_alternative<LinkOpened>(event)) {  // client: welcome
        auto link = std::move(waiting.link);
        pending.erase(connection);
        if (links.empty()) links[LinkId{1}].id = LinkId{1};
        attach(links.begin()->second, std::move(link), now);
        break;
      }
    }
  }
  return any;
}

void Side::State::fail_pending(ConnectionId connection, CloseCode code, const std::string& reason,
                               const Now& now) {
  const auto it = pending.find(connection);
  if (it == pending.end()) return;
  outputs.log(LogLevel::kWarn, "closing " + it->second.link->peer().address + ": " + reason + " (" +
                                   std::string(name_of(code)) + ")");
  last_failure = reason;
  close(connection, code, reason);
  pending.erase(it);
  if (options.role == Role::kClient) dial_later(false, now);
}

void Side::State::on(Authenticated& input, const Now& now) {
  const auto it = pending.find(input.connection);
  if (it == pending.end() || it->second.link->state() != Link::State::kAuthenticating) return;
  const bool expired =
      input.identity && input.identity->expires != 0 && now.system >= input.identity->expires;
  if (!input.identity || expired) {
    outputs.log(LogLevel::kWarn, "login refused: " + (expired ? "it has expired" : input.reason));
    // The peer learns no more than that.
    return fail_pending(input.connection, CloseCode::kLoginRefused, "login refused", now);
  }
  LinkEntry* entry = entry_for_login(*it->second.link, *input.identity, now);
  if (!entry)
    return fail_pending(input.connection, CloseCode::kTooManyConnections, "too many links", now);
  auto link = std::move(it->second.link);
  pending.erase(it);
  entry->identity = *input.identity;
  LinkEvents opened;
  link->on_authenticated(*input.identity, entry->session, now, opened);
  attach(*entry, std::move(link), now);
}

// The link whose session the client continues, if it is its own; else a new one, or null at the
// limit.
LinkEntry* Side::State::entry_for_login(const Link& link, const Identity& identity,
                                        const Now& now) {
  for (auto& [id, entry] : links)
    if (link.peer().session && entry.session == link.peer().session &&
        entry.identity.name == identity.name)
      return &entry;
  if (links.size() >= options.links_max) {
    // A link that waits for its client's return gives way to one that is here.
    const auto lost = std::find_if(links.begin(), links.end(),
                                   [](const auto& l) { return l.second.forgotten_at.has_value(); });
    if (lost == links.end()) return nullptr;
    on_link_dead(lost->first, now);
    links.erase(lost);
  }
  LinkEntry& entry = links[LinkId{++last_link}];
  entry.id = LinkId{last_link};
  entry.session = new_token(true);
  return &entry;
}

void Side::State::attach(LinkEntry& entry, std::unique_ptr<Link> link, const Now& now) {
  if (entry.link) {
    close(entry.link->connection(), CloseCode::kReplaced,
          "a newer connection of this session took over");
    detach(entry, false, now);
  }
  // Another process at the other end: what was pending with the one before is answered by nobody.
  if (entry.peer_side && entry.peer_side != link->peer().side) end_calls(entry.id, now);
  entry.peer_side = link->peer().side;
  entry.link = std::move(link);
  entry.forgotten_at.reset();
  entry.orphans_end_at = now.steady + kOffersTime;
  entry.opened_at = now.steady;
  entry.session = entry.link->peer().session;
  entry.address = entry.link->peer().address;
  entry.node = entry.link->peer().node;
  ++entry.connects;
  const ConnectionId connection = entry.link->connection();
  last_failure.clear();
  outputs.push(OpenGate{connection, static_cast<std::uint32_t>(kPacketBytesMax)});
  outputs.log(LogLevel::kInfo,
              "link open with " + entry.label() +
                  (entry.identity.name.empty() ? "" : " as " + entry.identity.name));
  send_accepts(entry);
  if (options.clock_publish_period > Duration::zero()) {
    entry.link->set_time_period(kClockRequestPeriod);
    clock_publisher.start(options.names.to_local("/clock"), outputs, now);
  }
}

void Side::State::send_accepts(LinkEntry& entry) const {
  Accepts accepts = policy.accepts(entry.identity);
  accepts.message_bytes_max = options.reassembly.message_bytes_max;
  entry.send(accepts);
}

// The connection is gone (or about to be). `dead`: the link is dead at once, else after dead_after
// of silence.
void Side::State::detach(LinkEntry& entry, bool dead, const Now& now) {
  const TimePoint heard = entry.link->last_heard();
  keep_counts(entry);
  entry.link->close();
  on_link_lost(entry, now);
  entry.link.reset();
  entry.events.clear();
  entry.accepts.reset();
  entry.offers_complete = false;
  entry.forgotten_at = dead ? now.steady : std::max(now.steady, heard + options.dead_after);
  if (dead) on_link_dead(entry.id, now);
  entry.orphans_end_at.reset();
  if (options.role == Role::kServer || stopping) return;
  // A peer that accepts the login and then ends the link is not dialed in a hurry for ever.
  if (now.steady - entry.opened_at >= kSteadyLink) dialer.opened();
  dial_later(false, now);
}

void Side::State::keep_counts(LinkEntry& entry) {
  LinkStatus last;
  exports.add_status(entry, last);
  imports.add_status(entry, last);
  for (auto& topic : last.topics) {
    topic.dropped.add(DropReason::kLinkLost, topic.queued);
    if (topic.messages + topic.dropped.total() == 0) continue;
    const std::tuple key{topic.exported, topic.topic, topic.type};
    if (entry.past.size() < kPastTopicsMax || entry.past.contains(key))
      entry.past[key].add_past(topic);
  }
}

void Side::State::dial_later(bool login_refused, const Now& now) {
  dialing = {};
  dialer.failed(now.steady, login_refused, random);
}

void Side::State::dial_if_due(const Now& now) {
  if (options.role != Role::kClient || !dialer.take_due(now.steady)) return;
  dialing = {++last_connection};
  outputs.push(Dial{dialing});
}

void Side::State::on_link_time(const Now& now) {
  for (auto& [connection, waiting] : pending) waiting.link->on_time(now, waiting.events);
  for (auto it = links.begin(); it != links.end();) {
    LinkEntry& entry = it->second;
    const Stamp expires = entry.identity.expires;
    if (entry.link) entry.link->on_time(now, entry.events);
    if (entry.open() && expires != 0 && now.system >= expires)
      entry.fail({CloseCode::kExpired, "the login of " + entry.identity.name + " has expired"});
    if (entry.orphans_end_at && *entry.orphans_end_at <= now.steady) {
      entry.orphans_end_at.reset();
      forget_orphans(entry.id, now);
    }
    if (!entry.forgotten_at || *entry.forgotten_at > now.steady) {
      ++it;
      continue;
    }
    on_link_dead(entry.id, now);
    entry.forgotten_at.reset();
    clock_publisher.stop(outputs);
    it = options.role == Role::kServer ? links.erase(it) : std::next(it);
  }
}

}  // namespace connect_bridge
