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

ConnectionOptions Side::State::connection_options() {
  ConnectionOptions o;
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

Link* Side::State::link_of(ConnectionId connection) {
  for (auto& [id, link] : links)
    if (link.connection && link.connection->id() == connection) return &link;
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
  waiting.connection =
      std::make_unique<Connection>(connection_options(), input.connection, input.peer, now);
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
    return it->second.connection->on_packet(input.text, input.payload, now, it->second.events);
  if (Link* link = link_of(input.connection))
    link->connection->on_packet(input.text, input.payload, now, link->events);
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
  Link* link = link_of(input.connection);
  if (!link) return;
  outputs.log(LogLevel::kWarn, "lost the link with " + link->label() + ": " + reason);
  last_failure = reason;
  detach(*link, left_for_good(input.code), now);
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
    ConnectionEvents events;
    events.swap(waiting.events);
    for (auto& event : events) {
      any = true;
      if (auto* asked = std::get_if<LoginAsked>(&event)) {
        outputs.push(Authenticate{connection, waiting.connection->peer().address,
                                  std::move(asked->method), std::move(asked->credential)});
      } else if (auto* failed = std::get_if<ConnectionFailed>(&event)) {
        fail_pending(connection, failed->code, failed->reason, now);
        break;
      } else if (std::holds_alternative<LoggedIn>(event)) {  // client: welcome
        auto opened = std::move(waiting.connection);
        pending.erase(connection);
        if (links.empty()) links[LinkId{1}].id = LinkId{1};
        attach(links.begin()->second, std::move(opened), now);
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
  outputs.log(LogLevel::kWarn, "closing " + it->second.connection->peer().address + ": " + reason +
                                   " (" + std::string(name_of(code)) + ")");
  last_failure = reason;
  close(connection, code, reason);
  pending.erase(it);
  if (options.role == Role::kClient) dial_later(false, now);
}

void Side::State::on(Authenticated& input, const Now& now) {
  const auto it = pending.find(input.connection);
  if (it == pending.end() || it->second.connection->state() != Connection::State::kAuthenticating)
    return;
  const bool expired =
      input.identity && input.identity->expires != 0 && now.system >= input.identity->expires;
  if (!input.identity || expired) {
    outputs.log(LogLevel::kWarn, "login refused: " + (expired ? "it has expired" : input.reason));
    // The peer learns no more than that.
    return fail_pending(input.connection, CloseCode::kLoginRefused, "login refused", now);
  }
  Link* link = link_for_login(*it->second.connection, *input.identity, now);
  if (!link)
    return fail_pending(input.connection, CloseCode::kTooManyConnections, "too many links", now);
  auto connection = std::move(it->second.connection);
  pending.erase(it);
  link->identity = *input.identity;
  ConnectionEvents opened;
  connection->on_authenticated(*input.identity, link->session, now, opened);
  attach(*link, std::move(connection), now);
}

// The link whose session the client continues, if it is its own; else a new one, or null at the
// limit.
Link* Side::State::link_for_login(const Connection& connection, const Identity& identity,
                                  const Now& now) {
  for (auto& [id, link] : links)
    if (connection.peer().session && link.session == connection.peer().session &&
        link.identity.name == identity.name)
      return &link;
  if (links.size() >= options.links_max) {
    // A link that waits for its client's return gives way to one that is here.
    const auto lost = std::find_if(links.begin(), links.end(),
                                   [](const auto& l) { return l.second.forgotten_at.has_value(); });
    if (lost == links.end()) return nullptr;
    on_link_dead(lost->first, now);
    links.erase(lost);
  }
  Link& link = links[LinkId{++last_link}];
  link.id = LinkId{last_link};
  link.session = new_token(true);
  return &link;
}

void Side::State::attach(Link& link, std::unique_ptr<Connection> connection, const Now& now) {
  if (link.connection) {
    close(link.connection->id(), CloseCode::kReplaced,
          "a newer connection of this session took over");
    detach(link, false, now);
  }
  // Another process at the other end: what was pending with the one before is answered by nobody.
  if (link.peer_side && link.peer_side != connection->peer().side) end_calls(link.id, now);
  link.peer_side = connection->peer().side;
  link.connection = std::move(connection);
  link.forgotten_at.reset();
  link.orphans_end_at = now.steady + kOffersTime;
  link.opened_at = now.steady;
  link.session = link.connection->peer().session;
  link.address = link.connection->peer().address;
  link.node = link.connection->peer().node;
  ++link.connects;
  last_failure.clear();
  outputs.push(OpenGate{link.connection->id(), static_cast<std::uint32_t>(kPacketBytesMax)});
  outputs.log(LogLevel::kInfo, "link open with " + link.label() +
                                   (link.identity.name.empty() ? "" : " as " + link.identity.name));
  send_accepts(link);
  if (options.clock_publish_period > Duration::zero()) {
    link.connection->set_time_period(kClockRequestPeriod);
    clock_publisher.start(options.names.to_local("/clock"), outputs, now);
  }
}

void Side::State::send_accepts(Link& link) const {
  Accepts accepts = policy.accepts(link.identity);
  accepts.message_bytes_max = options.reassembly.message_bytes_max;
  link.send(accepts);
}

// The connection is gone (or about to be). `dead`: the link is dead at once, else after dead_after
// of silence.
void Side::State::detach(Link& link, bool dead, const Now& now) {
  const TimePoint heard = link.connection->last_heard();
  keep_counts(link);
  link.connection->close();
  on_link_lost(link, now);
  link.connection.reset();
  link.events.clear();
  link.accepts.reset();
  link.offers_complete = false;
  link.forgotten_at = dead ? now.steady : std::max(now.steady, heard + options.dead_after);
  if (dead) on_link_dead(link.id, now);
  link.orphans_end_at.reset();
  if (options.role == Role::kServer || stopping) return;
  // A peer that accepts the login and then ends the link is not dialed in a hurry for ever.
  if (now.steady - link.opened_at >= kSteadyLink) dialer.opened();
  dial_later(false, now);
}

void Side::State::keep_counts(Link& link) {
  LinkStatus last;
  exports.add_status(link, last);
  imports.add_status(link, last);
  for (auto& topic : last.topics) {
    topic.dropped.add(DropReason::kLinkLost, topic.queued);
    if (topic.messages + topic.dropped.total() == 0) continue;
    const std::tuple key{topic.exported, topic.topic, topic.type};
    if (link.past.size() < kPastTopicsMax || link.past.contains(key))
      link.past[key].add_past(topic);
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
  for (auto& [connection, waiting] : pending) waiting.connection->on_time(now, waiting.events);
  for (auto it = links.begin(); it != links.end();) {
    Link& link = it->second;
    const Stamp expires = link.identity.expires;
    if (link.connection) link.connection->on_time(now, link.events);
    if (link.open() && expires != 0 && now.system >= expires)
      link.fail({CloseCode::kExpired, "the login of " + link.identity.name + " has expired"});
    if (link.orphans_end_at && *link.orphans_end_at <= now.steady) {
      link.orphans_end_at.reset();
      forget_orphans(link.id, now);
    }
    if (!link.forgotten_at || *link.forgotten_at > now.steady) {
      ++it;
      continue;
    }
    on_link_dead(link.id, now);
    link.forgotten_at.reset();
    clock_publisher.stop(outputs);
    it = options.role == Role::kServer ? links.erase(it) : std::next(it);
  }
}

}  // namespace connect_bridge
