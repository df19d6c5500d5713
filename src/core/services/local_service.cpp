#include "core/services/local_service.hpp"

#include <algorithm>
#include <utility>

#include "core/base/cdr.hpp"
#include "core/base/hex.hpp"
#include "core/policy/interface.hpp"
#include "core/services/local_services.hpp"

namespace connect_bridge {

LocalService::LocalService(ServiceKey key, LocalServices& exports)
    : exports_(exports),
      what_(std::make_shared<LocalInterface>(
          LocalInterface{InterfaceKind::kService, std::move(key)})),
      gives_results_(is_result_service(what_->key.first)),
      gate_(gives_results_) {
  const auto part = part_of_action(InterfaceKind::kService, what_->key.first, what_->key.second);
  if (part && (part->part == ActionPart::kSendGoal || part->part == ActionPart::kGetResult))
    action_ = part->action;
}

namespace {

// A wait of a call at a busy server that is worth a line.
constexpr Duration kWaitTold = std::chrono::seconds(1);

// The answer to a goal begins with whether the server has accepted it.
bool refuses_goal(ByteView answer) {
  return answer.size() > kCdrHeaderBytes && answer[kCdrHeaderBytes] == 0;
}

}  // namespace

// ---- the graph

void LocalService::update_servers(const ServiceState& state, const Now& now) {
  // The first ids may belong to servers that were here all the time, since the graph has ids only
  // while there is a client. A server that appears later cannot have received earlier requests
  // (end_lost).
  std::map<Gid, TimePoint> servers;
  const auto first_seen = servers_.empty() ? TimePoint::min() : now.steady;
  for (const auto& server : state.servers) {
    if (server.gid == Gid{}) continue;
    const auto known = servers_.find(server.gid);
    servers[server.gid] = known == servers_.end() ? first_seen : known->second;
  }
  node_ = node_of(state.servers.front());
  // Two servers of one node are mostly a killed process, which stays in the graph for a while, and
  // its successor.
  has_several_servers_ = std::any_of(state.servers.begin(), state.servers.end(),
                                     [&](const Server& s) { return node_of(s) != node_; });
  if (has_several_servers_ && !std::exchange(warned_several_, true))
    exports_.outputs.log(LogLevel::kWarn, key().first +
                                              " has several servers: each call reaches all of "
                                              "them, and the first answer counts");
  const bool lacks = state.lack.has_value();
  if (std::exchange(lacks_type_, lacks) != lacks) exports_.news.insert(key());
  const auto stays = [&](const auto& server) { return servers.contains(server.first); };
  // A server that replaces the old one does not know the calls that were made.
  const bool replaced = !servers.empty() && !servers_.empty() &&
                        std::none_of(servers_.begin(), servers_.end(), stays);
  // The graph has ids of servers only for some services, and only while there is a client.
  if (servers.empty() || servers == servers_) return;
  if (std::exchange(failed_, false)) forget_ended();
  servers_ = std::move(servers);
  if (!replaced) return end_lost(now);  // mutant: server_replaced
  end(now);
  offer_again();  // on a new channel
}

void LocalService::leave() {
  leaving_ = true;
  lose_server();
}

// The gate comes first: no call may begin while the service offers end one by one.
void LocalService::lose_server() {
  gate_.server_gone();
  forget_own();
  if (!action_.empty()) exports_.goals.on_server_gone(action_);
}

void LocalService::end(const Now& now) {
  Course all;
  static_cast<void>(end_some(all, now));
}

bool LocalService::end_some(Course& course, const Now& now) {
  lose_server();
  while (!service_offers_.empty()) {
    if (!course.take()) return false;
    const auto first = service_offers_.begin();
    first->second.end({"it has no server any longer"}, now);
    service_offers_.erase(first);
  }
  release_client();
  return true;
}

// Links whose service offer has ended receive the offer again.
void LocalService::forget_ended() {
  const auto ended = std::erase_if(service_offers_, [](const auto& entry) {
    return !entry.second.is_offered() && entry.second.is_idle();
  });
  if (ended > 0) offer_again();
}

void LocalService::offer_again() {
  exports_.news.insert(key());
  exports_.outputs.follow_up(FollowUp::kOffers);
}

void LocalService::end_lost(const Now& now) {
  // Each call goes to all servers that exist at that time. Requests since the appearance of the
  // oldest remaining server may still be answered; only older ones are lost.
  TimePoint since = TimePoint::max();
  for (const auto& [gid, seen] : servers_) since = std::min(since, seen);
  for (auto& [link, service_offer] : service_offers_) service_offer.end_lost(since, now);
}

// ---- links

bool LocalService::is_due(LinkId link) const {
  const auto it = service_offers_.find(link);
  if (leaving_) return false;
  return it == service_offers_.end() || (!failed_ && it->second.is_due());
}

std::optional<ChannelOffer> LocalService::offer(Link& link, const Now& now) {
  if (!is_due(link.id)) return std::nullopt;
  std::optional<ChannelOffer> opened;
  if (service_offers_.contains(link.id) || !lacks_type_)
    opened = service_offers_.try_emplace(link.id, *this, link, exports_).first->second.offer(now);
  if (!opened) tell_lack(exports_, link, *what_);
  return opened;
}

void LocalService::review(Link& link, const Now& now) {
  const auto it = service_offers_.find(link.id);
  if (it == service_offers_.end()) return;
  // The caller of the review collects new offers afterwards.
  if (const auto why = it->second.review()) remove(it, *why, now);
}

void LocalService::on_link_lost(LinkId link) {
  const auto it = service_offers_.find(link);
  if (it == service_offers_.end()) return;
  it->second.on_link_lost();
  if (it->second.is_idle()) service_offers_.erase(it);
}

void LocalService::on_link_dead(LinkId link, const Now& now) {
  const auto it = service_offers_.find(link);
  if (it == service_offers_.end() || it->second.is_idle()) return;
  remove(it, {"the link has ended"}, now);
}

void LocalService::remove(ServiceOffers::iterator service_offer, const Ending& why,
                          const Now& now) {
  service_offer->second.end(why, now);
  service_offers_.erase(service_offer);
  release_client();
}

// The new service offer draws another epoch, so old numbers mean nothing any more. Other links keep
// theirs: a peer that uses up its numbers ends only its own calls.
void LocalService::renew(LinkId link, const Now& now) {
  const auto it = service_offers_.find(link);
  if (it != service_offers_.end()) remove(it, LinkOffer::offered_again(), now);
  offer_again();
}

// ---- the client

void LocalService::use_client() {
  if (client_ || leaving_) return;
  failed_ = false;
  // Without a client the graph had no ids: the known ones may belong to servers that are gone.
  servers_.clear();
  if (const auto it = exports_.graph.services().find(key()); it != exports_.graph.services().end())
    for (const auto& server : it->second.servers)
      if (server.gid != Gid{}) servers_[server.gid] = TimePoint::min();
  client_ = exports_.outputs.new_id<ServiceClientId>();
  exports_.by_client[client_] = this;
  gate_ = CallGate(gives_results_);
  exports_.outputs.push(CreateServiceClient{client_, key().first, key().second});
  note_action_use(true);
}

void LocalService::release_client() {
  const bool held = std::any_of(service_offers_.begin(), service_offers_.end(),
                                [](const auto& e) { return e.second.holds_client(); });
  if (held || !client_ || !to_cancel_.empty() || !own_.empty()) return;
  room_.cancel();
  wait_logged_.cancel();
  exports_.outputs.push(DestroyServiceClient{client_});
  exports_.by_client.erase(client_);
  client_ = {};
  ready_ = false;
  note_action_use(false);
}

// A peer that is attached to the goals can send one at any time. Feedback and status stay
// subscribed that long (LocalTopics::hold_action).
void LocalService::note_action_use(bool on) {
  if (action_.empty() || gives_results_) return;
  exports_.action_uses.push_back({action_, on});
  exports_.outputs.follow_up(FollowUp::kActions);
}

void LocalService::on(const ServiceReady& ready, const Now& now) {
  if (ready_ == ready.ready) return;
  // The middleware cannot reach the server, though the graph may still show it. Calls under way get
  // no answer. A peer that attaches to the new offer waits until the service can be called
  // (docs/protocol.md section 9.2).
  if (!ready.ready) {
    end(now);
    return offer_again();
  }
  ready_ = true;
  type_hash_ = ready.type_hash;
  send_own();
  for (auto& [id, service_offer] : service_offers_) service_offer.on_ready(now);
  forget_ended();  // service offers of a client that could not be made
}

void LocalService::on(const ServiceClientFailed& failed, const Now& now) {
  // The service offers end but stay in the table, so that links do not receive the offer again at
  // once, over and over. They receive it when servers change, or when a client can be made after
  // all (forget_ended).
  exports_.by_client.erase(client_);
  const std::string what = shown(InterfaceKind::kService, key().first, key().second);
  exports_.outputs.log_once(LogLevel::kError, "cannot export " + what + ": " + failed.reason);
  failed_ = true;
  invocations_.clear();  // the gateway has dropped all of them
  note_action_use(false);
  gate_.server_gone();
  forget_own();
  for (auto& [link, service_offer] : service_offers_)
    service_offer.end({failed.reason, failed.code}, now);
  room_.cancel();
  wait_logged_.cancel();
  client_ = {};
}

InvocationId LocalService::invoke(ServedCall& call, Payload request, const Now& now) {
  const InvocationId invocation = exports_.outputs.new_id<InvocationId>();
  invocations_[invocation] = &call;
  gate_.handed_over(call.offer().link(), call.id(), invocation, now.steady);
  if (!action_.empty()) note_goal(call, request, invocation);
  exports_.outputs.push(SendRequest{client_, invocation, std::move(request),
                                    call.offer().line_of_call(AuditEvent::kCall)});
  return invocation;
}

// The request sends a goal, or waits for the end of one.
void LocalService::note_goal(ServedCall& call, const Payload& request, InvocationId invocation) {
  if (gives_results_) return exports_.goals.on_asked(action_, request.view(), invocation);
  const Duration cancel_after = call.offer().treatment().cancel_after;
  const auto id = goal_in(request.view());
  if (cancel_after == kForever || !id) return;  // mutant: cancel_after
  exports_.goals.add({action_, *id, call.offer().sender(), invocation, cancel_after,
                      call.offer().line_of_call(AuditEvent::kCall)});
}

void LocalService::cancel(SentGoal goal) {
  to_cancel_.push_back(std::move(goal));
  use_client();
  send_own();
}

void LocalService::send_own() {
  if (!ready_) return;
  // A server's queue that is full drops requests without a word.
  while (!to_cancel_.empty() && own_.size() < kOwnAtOnce) {
    const InvocationId invocation = exports_.outputs.new_id<InvocationId>();
    exports_.outputs.push(SendRequest{client_, invocation, cancel_request(to_cancel_.front().id)});
    own_.emplace(invocation, std::move(to_cancel_.front()));
    to_cancel_.pop_front();
  }
}

std::optional<SentGoal> LocalService::end_own(InvocationId invocation) {
  auto own = own_.extract(invocation);
  if (own.empty()) return std::nullopt;
  send_own();
  release_client();
  return std::move(own.mapped());
}

void LocalService::on_cancel_answered(const SentGoal& goal, ByteView answer) {
  if (!accepts_cancel(answer))
    return exports_.outputs.log(LogLevel::kInfo, "a goal of " + goal.sender.owner + " at " +
                                                     goal.action +
                                                     " is not cancelled: it has ended, or its "
                                                     "server refuses");
  if (!goal.line) return;
  Audit line = *goal.line;
  line.event = AuditEvent::kGoalCancelled;
  line.code = "link_lost";
  line.reason = "goal " + to_hex(goal.id);
  exports_.outputs.push(std::move(line));
}

void LocalService::forget_own() {
  to_cancel_.clear();
  own_.clear();
}

void LocalService::drop(InvocationId invocation) {
  if (take_invocation(invocation)) exports_.outputs.push(DropInvocation{client_, invocation});
}

ServedCall* LocalService::take_invocation(InvocationId invocation) {
  const auto it = invocations_.find(invocation);
  if (it == invocations_.end()) return nullptr;
  ServedCall* call = it->second;
  invocations_.erase(it);
  return call;
}

void LocalService::on(ResponseTaken& response, const Now& now) {
  if (const auto goal = end_own(response.invocation))
    return on_cancel_answered(*goal, response.payload.view());
  if (gives_results_ || (!action_.empty() && refuses_goal(response.payload.view())))
    exports_.goals.on_ended(response.invocation);
  // An answer counts even if nobody waits for it: it shows that the server takes its requests.
  gate_.answered(response.invocation, now.steady);
  if (ServedCall* call = take_invocation(response.invocation))
    call->on_response(std::move(response.payload), now);
  begin_calls(now);
}

void LocalService::on(const InvocationFailed& failed, const Now& now) {
  if (const auto goal = end_own(failed.invocation)) {
    exports_.outputs.log(LogLevel::kWarn, "a goal of " + goal->sender.owner + " at " +
                                              goal->action + " is not cancelled: " + failed.reason);
    return;
  }
  // A failure counts even if nobody waits: the server's queue has room again.
  gate_.failed(failed.invocation);
  if (ServedCall* call = take_invocation(failed.invocation))
    call->offer().on_failed(*call, failed.reason, now);
  begin_calls(now);
}

void LocalService::begin_calls(const Now& now) {
  if (exports_.held) return;
  // One call at a time: a call that begins may end, and so may free places or end the next calls.
  while (const auto next = gate_.next(now.steady))
    service_offers_.at(next->caller).begin(next->call, now);
  // A later deadline leaves the timer as it is; the timer then fires once without effect.
  const auto deadline = gate_.deadline();
  if (deadline && (!room_ || room_.at() <= now.steady))
    room_ = exports_.timers.set(*deadline, {this});
  tell_wait(now);
}

void LocalService::tell_wait(const Now& now) {
  const auto& wait = gate_.wait();
  if (!wait) return wait_logged_.cancel();
  const TimePoint at = wait->since + kWaitTold;
  if (now.steady < at) {
    if (!wait_logged_ || wait_logged_.at() != at) wait_logged_ = exports_.timers.set(at, {this});
    return;
  }
  const bool queue = wait->obstacle == CallGate::Obstacle::kQueue;
  exports_.outputs.log_once(
      LogLevel::kWarn,
      "calls of " + key().first +
          (queue ? " wait: its server has not answered the last ones, so its queue may be full. If "
                   "it leaves calls unanswered, `server_queue: 0` in their rule ends the wait"
                 : " wait: its server has left as many unanswered as `calls_max` allows. With a "
                   "`call_timeout` in their rule they give their places back"));
}

void LocalService::add_status(const Link& link, LinkStatus& status) const {
  const auto it = service_offers_.find(link.id);
  if (it != service_offers_.end()) it->second.add_status(status);
}

void LocalService::add_channels(const Link& link, std::vector<ChannelFacts>& channels) const {
  const auto it = service_offers_.find(link.id);
  if (it != service_offers_.end()) it->second.add_channel(channels);
}

}  // namespace connect_bridge
