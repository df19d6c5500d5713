// Dispatch: one input in, all its consequences out. Connections and links are in side_links.cpp.
#include "core/side/side.hpp"

#include <algorithm>
#include <utility>

#include "core/base/overloaded.hpp"
#include "core/side/side_state.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kWarnedMax = 1024;
// Every topic here is compared with them (docs/protocol.md, limits).
constexpr std::size_t kAcceptPatternsMax = 4096;

std::size_t patterns_of(const Accepts& accepts) {
  std::size_t count = accepts.deny.size();
  for (const auto& rule : accepts.rules)
    count += rule.topics.size() + rule.services.size() + rule.actions.size() +
             rule.parameters.size() + rule.types.size();
  return count;
}

}  // namespace

Side::State::State(SideOptions given, std::uint64_t seed)
    : options(std::move(given)),
      random(seed),
      side(new_token(false)),
      policy(options.policy),
      jobs({options.compress_job_bytes}, outputs),
      claims(side),
      dialer({options.retry_min, options.retry_max}),
      exports(options, policy, actions, links, jobs, outputs),
      imports(options, policy, graph, claims, links, outputs),
      service_exports(options, policy, graph, claims, actions, random, links, outputs),
      service_imports(options, policy, graph, claims, links, jobs, outputs),
      clock_publisher(options.clock_publish_period) {
  claims_mirror = outputs.new_mirror();
  claims_subscription = outputs.new_subscription();
  Qos qos;
  qos.durability = Durability::kTransientLocal;
  qos.depth = 1;
  outputs.push(CreateMirror{claims_mirror, kClaimsTopic, kClaimsType, "", qos});
  qos.depth = 100;  // one sample each of so many bridges
  outputs.push(CreateSubscription{claims_subscription, kClaimsTopic, kClaimsType, "", qos});
}

Token128 Side::State::new_token(bool secret) {
  Token128 token;
  for (std::size_t i = 0; i < token.bytes.size(); i += 8) {
    const std::uint64_t word =
        secret && options.secret_random ? options.secret_random() : random.next();
    for (std::size_t j = 0; j < 8; ++j)
      token.bytes[i + j] = static_cast<std::uint8_t>(word >> (8 * j));
  }
  return token;
}

void Side::State::warn_once(const std::string& text) {
  if (warned.size() < kWarnedMax && warned.insert(text).second) outputs.log(LogLevel::kWarn, text);
}

void Side::State::on(GraphChanged& input, const Now& now) {
  const auto bridges_before = graph.bridges();
  graph = GraphView(std::move(input));
  claims.retain(bridges_before, graph.bridges());
  exports.on_graph(graph, now);
  update_exports(now);
  imports.on_graph(now);
  service_imports.on_graph(now);
}

void Side::State::on(MessageTaken& input, const Now& now) {
  if (input.subscription != claims_subscription) return exports.on_taken(std::move(input), now);
  if (auto claim = parse_claim(input.payload.view()))
    if (claims.update(input.origin, std::move(*claim))) {
      update_exports(now);
      imports.on_claims(now);
      service_imports.on_claims(now);
    }
}

void Side::State::on(MessagesLost& input, const Now&) {
  exports.on_lost(input);
}

void Side::State::on(SubscriptionFailed& input, const Now&) {
  if (input.subscription == claims_subscription)
    return outputs.log(LogLevel::kError, "cannot watch for other bridges: " + input.reason);
  exports.on_subscription_failed(input);
}

void Side::State::on(MirrorFailed& input, const Now&) {
  if (input.mirror == claims_mirror)
    return outputs.log(LogLevel::kError, "cannot tell other bridges of this one: " + input.reason);
  imports.on_mirror_failed(input);
}

void Side::State::on(PublishFailed& input, const Now&) {
  imports.on_publish_failed(input);
}

void Side::State::on(QosIncompatible& input, const Now&) {
  warn_once(input.topic + ": " +
            (input.at_mirror ? "a subscriber here requests" : "a publisher here offers") +
            " an incompatible " + input.policy + "; they exchange nothing");
}

void Side::State::on(JobDone& input, const Now& now) {
  jobs.on_done(input, now);
  if (service_exports.on_job(input, now) || service_imports.on_job(input)) return;
  imports.on_job(input, now);
}

void Side::State::on(PolicyChanged& input, const Now& now) {
  policy = std::move(input.policy);
  for (auto& [id, link] : links)
    if (link.open()) send_accepts(link);
  service_exports.hold();
  for (auto& [id, link] : links) {
    if (link.open() && link.accepts)
      recheck(link, now);
    else
      service_exports.recheck(link, now);  // the calls of a lost connection lose their right, too
  }
  service_exports.go_on(now);
  imports.on_policy(now);
  service_imports.on_policy(now);
}

void Side::State::on(RequestTaken& input, const Now& now) {
  // The demand goes out before the goal does.
  if (const auto action = service_imports.action_of(input.mirror))
    imports.expect_goal(*action, now);
  service_imports.on_request(input, now);
}

void Side::State::on(CallersGone& input, const Now&) {
  service_imports.on_callers_gone(input);
}

void Side::State::on(ServiceReady& input, const Now& now) {
  service_exports.on_ready(input, now);
}

void Side::State::on(ResponseTaken& input, const Now& now) {
  service_exports.on_response(input, now);
}

void Side::State::on(InvocationFailed& input, const Now& now) {
  service_exports.on_invocation_failed(input, now);
}

void Side::State::on(ServiceMirrorFailed& input, const Now&) {
  service_imports.on_mirror_failed(input);
}

void Side::State::on(ServiceClientFailed& input, const Now& now) {
  service_exports.on_client_failed(input, now);
}

void Side::State::on(StopRequested&, const Now& now) {
  stopping = true;
  dialer.stop();
  for (auto& [connection, waiting] : pending)
    close(connection, CloseCode::kGoingAway, "this side stops");
  pending.clear();
  for (auto& [id, link] : links) {
    if (!link.connection) continue;
    close(link.connection->id(), CloseCode::kGoingAway, "this side stops");
    detach(link, true, now);
  }
  clock_publisher.stop(outputs);
  outputs.push(Stopped{});
}

void Side::State::on(TimePassed&, const Now& now) {
  on_link_time(now);
  exports.on_time(now);
  imports.on_time(now);
  service_exports.on_time(now);
  service_imports.on_time(now);
  clock_publisher.on_time(outputs, now);
  dial_if_due(now);
}

void Side::State::settle(const Now& now) {
  do {
    imports.send_demands();
    hold_actions(now);
    if (service_exports.take_offers_due()) send_offers(now);
  } while (handle_pending_events(now) || handle_link_events(now));
  const bool topics = imports.take_claim_change();
  const bool services = service_imports.take_claim_change();
  if (topics || services) publish_claim(now);
}

void Side::State::publish_claim(const Now& now) {
  Claim claim{side, imports.mirrored()};
  service_imports.add_mirrored(claim.origins);
  outputs.push(Publish{claims_mirror, serialize(claim, now.system)});
}

bool Side::State::handle_link_events(const Now& now) {
  bool any = false;
  for (auto& [id, link] : links) {
    ConnectionEvents events;
    events.swap(link.events);
    for (auto& event : events) {
      any = true;
      const auto result = on_link_event(link, event, now);
      if (!result) end_link(link, result.error(), now);
      if (!link.connection) break;  // what follows the end of the connection no longer counts
    }
  }
  return any;
}

void Side::State::end_link(Link& link, const Error& error, const Now& now) {
  outputs.log(LogLevel::kWarn, "closing the link with " + link.label() + ": " + error.message +
                                   " (" + std::string(name_of(error.code)) + ")");
  last_failure = error.message;
  close(link.connection->id(), error.code, error.message);
  detach(link, error.code == CloseCode::kSilent, now);
}

Result<Nothing> Side::State::on_link_event(Link& link, ConnectionEvent& event, const Now& now) {
  return std::visit(Overloaded{
                        [&](Control& control) { return on_control(link, control, now); },
                        [&](InMessage& message) { return on_message(link, message, now); },
                        [&](Delivered& whole) -> Result<Nothing> {
                          const CallId call{whole.origin.value};
                          if (auto* channel = link.outgoing(whole.channel))
                            channel->on_delivered(call, now);
                          service_imports.on_delivered(link, whole.channel, call);
                          service_exports.on_delivered(link.id, whole.channel, call);
                          return Nothing{};
                        },
                        [&](PeerRosTime& time) -> Result<Nothing> {
                          clock_publisher.on_reply(time.reply, time.t4);
                          return Nothing{};
                        },
                        [&](ConnectionFailed& failed) -> Result<Nothing> {
                          return Error{failed.code, failed.reason};
                        },
                        [&](auto&) -> Result<Nothing> {
                          return Nothing{};
                        },  // login events come before this state
                    },
                    event);
}

Result<Nothing> Side::State::on_control(Link& link, Control& control, const Now& now) {
  return std::visit(
      Overloaded{
          [&](Offer& m) { return on_offer(link, m, now); },
          [&](OriginsChanged& m) {
            auto* channel = link.incoming(m.channel);
            return channel ? channel->on_origins(m, now) : imports.on_origins(link, m, now);
          },
          [&](Withdraw& m) { return on_withdraw(link, m, now); },
          [&](Demand& m) {
            for (const ChannelId number : m.channels)
              if (auto* channel = link.outgoing(number)) channel->on_demand(m.on, now);
            return exports.on_demand(link, m, now);
          },
          [&](Accepts& m) -> Result<Nothing> {
            if (patterns_of(m) > kAcceptPatternsMax)
              return Error{CloseCode::kTooLarge, "more patterns accepted than this side compares"};
            if (link.connection && m.message_bytes_max > 0)
              link.connection->set_peer_message_bytes_max(m.message_bytes_max);
            link.accepts = std::move(m);
            service_exports.hold();
            recheck(link, now);
            service_exports.go_on(now);
            return Nothing{};
          },
          [&](Decline& m) -> Result<Nothing> {
            if (auto* channel = link.outgoing(m.channel)) {
              channel->on_decline(m, now);
              return Nothing{};
            }
            if (!service_exports.on_decline(link, m, now)) exports.on_decline(link, m, now);
            return Nothing{};
          },
          [&](Attach& m) { return on_attach(link, m, now); },
          [&](Attached& m) {
            auto* channel = link.incoming(m.channel);
            return channel ? channel->on_attached(m, now)
                           : service_imports.on_attached(link, m, now);
          },
          [&](Refuse& m) {
            auto* channel = link.incoming(m.channel);
            return channel ? channel->on_refuse(m, now) : service_imports.on_refuse(link, m, now);
          },
          [&](Forget& m) {
            auto* channel = link.outgoing(m.channel);
            return channel ? channel->on_forget(m, now) : service_exports.on_forget(link, m, now);
          },
      },
      control);
}

Side::Side(SideOptions options, std::uint64_t seed)
    : state_(std::make_unique<State>(std::move(options), seed)) {}

Side::~Side() = default;

void Side::handle(Input input, const Now& now) {
  State& s = *state_;
  if (s.stopping) return;
  if (!s.started) {
    s.started = true;
    s.publish_claim(now);
    s.imports.take_claim_change();
    s.service_imports.take_claim_change();
    s.dial_if_due(now);
  }
  std::visit([&](auto& i) { s.on(i, now); }, input);
  if (!s.stopping) s.settle(now);
}

std::optional<Action> Side::next_action() {
  return state_->outputs.next();
}

std::optional<Packet> Side::next_packet(ConnectionId connection, const Now& now) {
  const auto waiting = state_->pending.find(connection);
  if (waiting != state_->pending.end()) return waiting->second.connection->next_packet(now);
  Link* link = state_->link_of(connection);
  return link ? link->connection->next_packet(now) : std::nullopt;
}

std::optional<TimePoint> Side::next_deadline() const {
  const State& s = *state_;
  if (s.stopping) return std::nullopt;
  std::optional<TimePoint> first;
  const auto earlier = [&](const std::optional<TimePoint>& t) {
    if (t) first = first ? std::min(*first, *t) : *t;
  };
  for (const auto& [id, waiting] : s.pending) earlier(waiting.connection->deadline());
  for (const auto& [id, link] : s.links) {
    if (link.connection) earlier(link.connection->deadline());
    earlier(link.forgotten_at);
    earlier(link.orphans_end_at);
  }
  if (s.options.role == Role::kClient) earlier(s.dialer.deadline());
  earlier(s.exports.deadline());
  earlier(s.imports.deadline());
  earlier(s.service_exports.deadline());
  earlier(s.service_imports.deadline());
  earlier(s.clock_publisher.deadline());
  return first;
}

Status Side::status(const Now&) const {
  const State& s = *state_;
  Status status;
  status.last_failure = s.last_failure;
  status.memory_bytes = s.exports.memory_bytes() + s.imports.memory_bytes() +
                        s.service_exports.memory_bytes() + s.service_imports.memory_bytes();
  for (const auto& [id, link] : s.links) {
    LinkStatus shown;
    shown.peer = link.address;
    shown.node = link.node;
    shown.identity = link.identity.name;
    shown.open = link.open();
    shown.connects = link.connects;
    if (link.connection) {
      shown.sent_bytes = link.connection->sent_bytes();
      shown.received_bytes = link.connection->received_bytes();
      shown.queued_bytes =
          link.connection->outbox().data_bytes() + link.connection->outbox().kept_bytes();
      shown.unacknowledged_bytes = link.connection->outbox().unacknowledged_bytes();
      status.memory_bytes += shown.queued_bytes + link.connection->open_bytes();
      const ClockEstimate& clock = link.connection->clock();
      shown.clock = {clock.known(), clock.offset(), clock.round_trip(), clock.error_bound()};
    }
    s.exports.add_status(link, shown);
    s.imports.add_status(link, shown);
    s.service_exports.add_status(link, shown);
    s.service_imports.add_status(link, shown);
    for (auto& topic : shown.topics) {
      const auto past = link.past.find({topic.exported, topic.topic, topic.type});
      if (past != link.past.end()) topic.add_past(past->second);
    }
    status.links.push_back(std::move(shown));
  }
  return status;
}

}  // namespace connect_bridge
