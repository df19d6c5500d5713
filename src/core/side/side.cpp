#include "core/side/side.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "core/base/random.hpp"
#include "core/link/standing.hpp"
#include "core/offers/import_right.hpp"

namespace connect_bridge {
namespace {

constexpr Duration kClockRequestPeriod = std::chrono::milliseconds(100);

bool crosses(const std::string& name, const LinkStatus& link) {
  const auto is_topic = [&](const TopicStatus& topic) { return topic.topic == name; };
  const auto is_service = [&](const ServiceStatus& service) { return service.service == name; };
  return std::any_of(link.topics.begin(), link.topics.end(), is_topic) ||
         std::any_of(link.services.begin(), link.services.end(), is_service);
}

}  // namespace

Side::Side(SideOptions options, std::uint64_t seed, Stamp started)
    : options_(std::move(options)),
      random_(seed),
      side_(make_side_id(random_, started)),
      policy_(options_.policy),
      jobs_({options_.compress_job_bytes}, outputs_),
      local_(side_),
      links_(options_, side_, random_, outputs_, *this),
      view_{options_, policy_, local_.view, local_.claims, actions_, jobs_, outputs_},
      exports_(view_, options_, &links_.memory()),
      imports_(view_, options_),
      local_listeners_(view_),
      service_exports_(view_, options_, random_),
      service_imports_(view_, options_, options_.node),
      offering_(view_),
      missing_(view_),
      clock_publisher_(options_.clock_publish_period),
      claims_topic_(local_.claims, options_.dead_after, outputs_),
      drive_switch_(options_.drive_switch ? options_.node : "", outputs_) {
  outputs_.set_audits(options_.audits);
  outputs_.follow_up(FollowUp::kClaim);  // the first one, even if it names nothing
}

void Side::handle(Input input, const Now& now) {
  outputs_.begin_step();
  offering_.begin_step();
  local_listeners_.begin_step();
  if (stopping_) return;
  if (!std::exchange(started_, true)) links_.dial_if_due(now);
  if (claims_topic_.has_lapsed(now)) service_imports_.on_lapse(now);  // mutant: claims_lapse
  std::visit([&](auto& i) { on(i, now); }, input);
  if (!stopping_) settle(now);
}

// One input may change the demand for many channels, the use of actions, and the offers. Messages
// are sent to the peers once, after all of it is handled. Sending may fail a connection (a peer
// that does not read), and a lost link changes demand and offers again. The loop repeats until no
// connection fails; each failure removes one.
void Side::settle(const Now& now) {
  do {
    while (const auto what = outputs_.take_follow_up(FollowUp::kOffers)) follow(*what, now);
  } while (links_.settle(now));
  while (const auto what = outputs_.take_follow_up(FollowUp::kClaim)) follow(*what, now);
}

void Side::follow(FollowUp what, const Now& now) {
  switch (what) {
    case FollowUp::kRights: return recheck_rights(now);
    case FollowUp::kDemands: return imports_.send_demands();
    case FollowUp::kActions: return hold_actions(now);
    case FollowUp::kOffers: return offering_.go_on(exports_, service_exports_, now);
    case FollowUp::kWheels: return drive_switch_.answer(exports_, now);
    case FollowUp::kClock: return follow_clock();
    case FollowUp::kClaim:
      claims_topic_.change();
      if (claims_topic_.take_due(now)) publish_claim(now);
      return;
  }
}

void Side::follow_clock() {
  const bool clock = wants_clock(links_.all(), policy_);
  if (std::exchange(follows_clock_, clock) != clock) outputs_.push(FollowClock{clock});
}

// The topics of an action stay subscribed while its services are attached.
void Side::hold_actions(const Now& now) {
  for (const auto& use : service_exports_.take_action_uses())
    exports_.hold_action(use.action, use.on, now);
}

void Side::publish_claim(const Now& now) {
  Claim claim{side_};
  clock_publisher_.add_mirrored(claim);
  imports_.add_mirrored(claim, now);
  service_imports_.add_mirrored(claim);
  drive_switch_.add_mirrored(claim);
  claims_topic_.publish(std::move(claim), now);
  drive_switch_.appear();
}

// ---- the graph

void Side::on(GraphChanged& input, const Now& now) {
  on_graph(local_.update(std::move(input), now), now);
}

void Side::on_graph(const GraphDifference& difference, const Now& now) {
  missing_.on_change(now);
  exports_.on_graph(now);
  update_exports(now);
  local_listeners_.on_graph(difference, now);
  imports_.on_graph(now, difference);
  service_imports_.on_graph(now, difference);
}

// Parts of an action are offered while the action is whole.
void Side::update_exports(const Now& now) {
  service_exports_.on_graph(now);
  const auto changed = actions_.update(local_.view, local_.claims);
  changed_actions_.insert(changed.begin(), changed.end());
  if (!changed_actions_.empty()) return recheck_actions(now);
  offering_.go_on(exports_, service_exports_, now);
}

void Side::on(MessageTaken& input, const Now& now) {
  bool changed = false;
  if (!claims_topic_.on_taken(input, changed, now)) return exports_.on_taken(std::move(input), now);
  if (changed) on_claims(now);
}

// The mirrors of other bridges in this graph have changed.
void Side::on_claims(const Now& now) {
  outputs_.follow_up(FollowUp::kClock);
  if (local_.on_claims()) exports_.on_graph(now);
  update_exports(now);
  imports_.on_claims(links_.all(), now);
  service_imports_.on_claims(now);
  for (const auto& [id, link] : links_.all()) tell_same_graph(link);
}

// Nothing crosses then, and nothing has to.
void Side::tell_same_graph(const Link& link) {
  if (!link.open() || !local_.claims.is_here(link.peer().side)) return;
  outputs_.log_once(link.account->logged, LogLevel::kWarn,
                    link.label() +
                        " is in this same ROS graph: its nodes are reached without a bridge, and "
                        "nothing crosses this link. To keep two graphs apart on one network, start "
                        "the programs at one end with another ROS_DOMAIN_ID");
}

void Side::on(SubscriptionFailed& input, const Now& now) {
  if (!claims_topic_.on_failed(input)) exports_.on_subscription_failed(input, now);
}

void Side::on(MirrorFailed& input, const Now& now) {
  if (!claims_topic_.on_failed(input)) imports_.on_mirror_failed(input, now);
}

void Side::on(ServiceMirrorFailed& input, const Now& now) {
  if (!drive_switch_.on_failed(input)) service_imports_.on_mirror_failed(input, now);
}

void Side::on(RequestTaken& input, const Now& now) {
  if (drive_switch_.on_request(input, exports_, now)) return;
  if (const std::string* action = service_imports_.goals_of(input.mirror))
    imports_.expect_goal(*action, now);  // the demand must be sent before the goal
  service_imports_.on_request(input, now);
}

// ---- workers, operator, time

void Side::on(PolicyChanged& input, const Now& now) {
  policy_ = std::move(input.policy);
  for (auto& [id, link] : links_.all()) tell_rights(link, now);
  recheck_rights(now);
}

void Side::on(LimitsChanged& input, const Now& now) {
  options_.bytes_per_second_max = input.bytes_per_second_max;
  options_.outbox.bytes_per_second_max = input.link_bytes_per_second_max;
  options_.resume_for = input.resume_for;
  options_.resume_bytes_max = input.resume_bytes_max;
  links_.on(input, now);
}

// Channels may have ended since the findings were made.
void Side::on(FindingsMade& input, const Now&) {
  const auto has_name = [](const PeerFinding& finding) { return !finding.name.empty(); };
  for (auto& [id, findings] : input.of_links) {
    const auto found = links_.all().find(id);
    if (found == links_.all().end()) continue;
    Link& link = found->second;
    if (!link.open() || !link.accepts || !link.accepts->list().findings) continue;
    const Outputs::Paying paying(outputs_, link.account->time);
    if (std::any_of(findings.begin(), findings.end(), has_name)) {
      std::set<std::string> crossing;
      for (const ChannelFacts& channel : channels_of(link)) crossing.insert(channel.name);
      std::erase_if(findings, [&](const PeerFinding& finding) {
        return has_name(finding) && !crossing.contains(finding.name);
      });
    }
    link.send_findings(findings);
  }
}

std::vector<ChannelFacts> Side::channels_of(const Link& link) const {
  std::vector<ChannelFacts> channels;
  exports_.add_channels(link, channels);
  imports_.add_channels(link, channels);
  service_exports_.add_channels(link, channels);
  service_imports_.add_channels(link, channels);
  return channels;
}

Result<Nothing> Side::on(Link& link, const Renew& renew, const Now& now) {
  if (options_.role == Role::kClient) return Error{CloseCode::kIllegal, "a server does not log in"};
  return ask_for_renewal(link, renew, outputs_, now);
}

void Side::on_identity_changed(Link& link, const Now& now) {
  tell_rights(link, now);
  outputs_.follow_up(FollowUp::kRights);  // mutant: groups_change
  if (clock_from_ == link.id && !may_give_time(link)) {
    end_time_of_peer(now);
  } else if (!clock_from_ && link.open()) {
    take_time_of(link, now);
  }
}

void Side::tell_rights(Link& link, const Now& now) {
  if (link.open()) send_accepts(link);
  exports_.recheck_kept(link, now);  // also for a link that has returned and got no offer yet
}

void Side::recheck_rights(const Now& now) {
  recheck(now);
  for (auto& [id, link] : links_.all()) local_listeners_.recheck(link);
  local_listeners_.go_on(now);
  imports_.on_policy(now);
  service_imports_.on_policy(now);
}

void Side::on(StopRequested&, const Now& now) {
  stopping_ = true;
  imports_.on_stop(now);
  links_.stop(now);
  claims_topic_.end(side_, now);
  clock_publisher_.stop(outputs_);
  outputs_.push(Stopped{});
}

void Side::on(TimePassed&, const Now& now) {
  outputs_.on_time(now);
  const bool ended = links_.on_time(now);
  if (local_.claims.expire(now.steady)) on_claims(now);  // mutant: claims_expire
  while (local_.release(now)) on_graph({false, {}, {}, {}}, now);
  exports_.on_time(now);
  imports_.on_time(now);
  service_exports_.on_time(now);
  service_imports_.on_time(now);
  if (!ended && actions_go_on_at_ && *actions_go_on_at_ <= now.steady) recheck_actions(now);
  if (!ended) offering_.on_time(exports_, service_exports_, now);
  if (!ended) local_listeners_.on_time(now);
  look_for_missing(now);
  clock_publisher_.on_time(outputs_, local_.claims, now);
  drive_switch_.answer(exports_, now);
  links_.dial_if_due(now);
  if (claims_topic_.is_due(now)) outputs_.follow_up(FollowUp::kClaim);
}

std::optional<TimePoint> Side::next_deadline() const {
  if (stopping_) return std::nullopt;
  std::optional<TimePoint> first = links_.deadline();
  for (const auto& next : {exports_.deadline(), imports_.deadline(), service_exports_.deadline(),
                           service_imports_.deadline(), claims_topic_.deadline(), local_.deadline(),
                           offering_.deadline(), local_listeners_.deadline(), actions_go_on_at_,
                           missing_.deadline(), drive_switch_.deadline()})
    first = earliest(first, next);
  return earliest(first, clock_publisher_.deadline());
}

// ---- links

void Side::on_link_open(Link& link, const Now& now) {
  send_accepts(link);
  local_listeners_.begin(link, now);
  missing_.on_link_open(link, now);
  tell_same_graph(link);
  take_time_of(link, now);
  service_exports_.on_link_open(link);
}

bool Side::may_give_time(const Link& link) const {
  return options_.clock_publish_period > Duration::zero() &&
         is_for(options_.clock_identities, options_.clock_groups, link.login.identity());
}

// If several links may give the time, one does.
void Side::take_time_of(Link& link, const Now& now) {
  if (!may_give_time(link) || (clock_from_ && clock_from_ != link.id)) return;
  clock_from_ = link.id;
  link.connection()->set_time_period(kClockRequestPeriod, now);
  link.mark();
  clock_publisher_.start(link.names.to_local("/clock"), outputs_, now);
}

void Side::end_time_of_peer(const Now& now) {
  clock_from_ = {};
  clock_publisher_.stop(outputs_);
  for (auto& [id, other] : links_.all())
    if (other.open()) take_time_of(other, now);
}

bool Side::on_link_lost(Link& link, const Now& now) {
  LinkEnd& end = link.end;
  const auto begin = [&] {
    outputs_.follow_up(FollowUp::kClock);
    // First, so that messages published here now do not count as lost with the connection.
    imports_.finish(link, now);
    exports_.end_listeners(link.id, now);
    local_listeners_.on_link_lost(link.id);
    missing_.on_link_lost(link.id);
    offering_.forget(link.id);
    service_exports_.on_link_lost(link.id, now);
    if (end.dies) end_work(link, now);
    return true;
  };
  const bool over = end.part(0, begin) &&
                    end.part(1, [&] { return exports_.on_link_lost(link, end, now); }) &&
                    end.part(2, [&] { return imports_.on_link_lost(link.id, end, now); }) &&
                    end.part(3, [&] { return service_imports_.on_link_lost(link.id, end, now); }) &&
                    end.part(4, [&] { return service_exports_.end_offers(link.id, end); });
  if (over && !link.life.may_return()) link.arrived.clear();
  return over;
}

// Driving and calls of the peer must not go on until its mirrors have ended.
void Side::end_work(Link& link, const Now& now) {
  imports_.end_driving(link, now);
  service_exports_.on_link_dead(link, now);
}

bool Side::on_link_dead(Link& link, const Now& now) {
  LinkEnd& end = link.end;
  const auto begin = [&] {
    end_work(link, now);
    if (clock_from_ == link.id) end_time_of_peer(now);
    return true;
  };
  return end.part(0, begin) &&
         end.part(1,
                  [&] { return imports_.on_link_dead(link, end, now); }) &&  // mutant: mirror_ends
         end.part(2, [&] { return service_imports_.on_link_dead(link.id, end, now); });
}

void Side::on_link_forgotten(Link& link, const Now& now) {
  service_imports_.on_link_forgotten(link.id, now);
  on_session_forgotten(link, now);
}

void Side::on_session_forgotten(Link& link, const Now& now) {
  link.arrived.clear();
  link.published.clear();
  link.forget_texts();
  exports_.end_kept(link, now);
}

void Side::on_peer_replaced(Link& link, const Now& now) {
  service_exports_.on_link_dead(link, now);
  LinkEnd all;
  static_cast<void>(service_imports_.on_link_dead(link.id, all, now));
  on_link_forgotten(link, now);  // mutant: another_process
}

void Side::on_offers_over(Link& link, const Now& now) {
  imports_.forget_orphans(link, now);
  service_imports_.forget_orphans(link.id, now);
}

void Side::send_accepts(Link& link) {
  Accepts accepts = policy_.accepts(link.login.identity());
  accepts.message_bytes_max = options_.reassembly.message_bytes_max;
  accepts.ros_time = may_give_time(link);
  accepts.robot = options_.robot;
  accepts.base = link.take_base();
  accepts.findings = true;
  link.send(accepts);
}

Result<Nothing> Side::on(Link& link, Accepts accepts, const Now& now) {
  missing_.on_peer_rules(link, now);
  if (link.accepts.adopt(std::move(accepts))) recheck({&link}, now);
  return Nothing{};
}

// Rights are checked link by link. Until all are checked, no call starts and no subscription is
// made. Services come first: a topic that they release is then not subscribed again.
void Side::recheck(const std::vector<Link*>& links, const Now& now) {
  outputs_.follow_up(FollowUp::kClock);
  missing_.on_change(now);
  service_exports_.hold();
  exports_.hold();
  for (Link* link : links) service_exports_.review(*link, now);
  hold_actions(now);
  for (Link* link : links) exports_.review(*link, now);
  exports_.go_on(now);
  for (Link* link : links)
    if (link->open() && link->accepts) offering_.begin(*link);
  offering_.go_on(exports_, service_exports_, now);
  service_exports_.go_on(now);
}

// Links have offers of each part. An action takes all its turns in one step, services first.
void Side::recheck_actions(const Now& now) {
  missing_.on_change(now);
  service_exports_.hold();
  exports_.hold();
  Course course{.left = options_.offer_ends_at_once};
  while (!changed_actions_.empty() && course.take()) {
    const std::string action =
        std::move(changed_actions_.extract(changed_actions_.begin()).value());
    course.charge(kActionParts.size() * links_.all().size());
    for (const auto kind : {InterfaceKind::kService, InterfaceKind::kTopic})
      for (const ActionPart part : kActionParts)
        if (kind_of(part) == kind) recheck(kind, name_of_part(action, part), now);
  }
  actions_go_on_at_.reset();
  if (!changed_actions_.empty()) actions_go_on_at_ = now.steady;
  exports_.go_on(now);
  offering_.go_on(exports_, service_exports_, now);
  service_exports_.go_on(now);
}

void Side::recheck(InterfaceKind kind, const std::string& name, const Now& now) {
  for (auto& [id, link] : links_.all())
    if (kind == InterfaceKind::kService)
      service_exports_.review(link, name, now);
    else
      exports_.review(link, name, now);
  hold_actions(now);
}

Result<Nothing> Side::on(Link& link, const Offer& offer, const Now& now) {
  missing_.on_change(now);
  for (const ChannelOffer& channel : offer.channels)
    if (auto taken = take(link, channel, now); !taken) return taken;
  if (offer.complete) on_offers_over(link, now);
  return Nothing{};
}

Result<Nothing> Side::take(Link& link, const ChannelOffer& channel, const Now& now) {
  if (!channel.channel || link.expects(channel.channel))
    return Error{CloseCode::kIllegal, "a channel number was offered twice"};
  if (link.offered() >= options_.channels_max)
    return Error{CloseCode::kTooLarge, "more channels offered than this side accepts"};
  // Before an owner judges the channel: a declined channel stays offered, counts for the limit, and
  // may be withdrawn later.
  link.expect_offered(channel.channel, channel.kind);
  if (link.account->channels.used() > Account::kChannelsMax) {  // mutant: channels_of_identity
    decline(service_imports_, link, channel, "limit", "its identity offers too many channels");
  } else if (channel.kind == InterfaceKind::kService) {
    service_imports_.on_offer(link, channel, now);
  } else {
    imports_.on_offer(link, channel, now);
  }
  return Nothing{};
}

// One link at a time: a check costs as much as the link has channels.
void Side::look_for_missing(const Now& now) {
  const auto id = missing_.take_due(now);
  const auto found = id ? links_.all().find(*id) : links_.all().end();
  if (found == links_.all().end() || !found->second.open()) return;
  Link& link = found->second;
  const Outputs::Paying paying(outputs_, link.account->time);
  LinkPicture picture;
  picture.at = now.steady;
  picture.channels = channels_of(link);
  picture.heard = exports_.listened_by(link);
  auto wishes = wishes_of(local_.view, local_.claims, !options_.at_robot);
  picture.brought = std::erase_if(wishes, [&](const Wish& wish) {
                      if (wish.exported) return false;
                      return wish.kind == InterfaceKind::kTopic
                                 ? imports_.has_mirror({wish.name, wish.type})
                                 : service_imports_.has_mirror({wish.name, wish.type});
                    }) > 0;
  missing_.look(link, wishes, std::move(picture), now);
}

// ---- status

LinkStatus Side::status_of(const Link& link, const Now& now) const {
  LinkStatus shown = link.status();
  shown.at = now.steady;
  if (link.open()) {
    shown.open_for = link.life.open_for(now);
    shown.unheard = link.connection()->unheard(now);
    shown.same_graph = local_.claims.is_here(link.connection()->peer().side);
    shown.two_of_a_kind =
        !options_.robot.empty() && link.accepts && link.accepts->list().robot == options_.robot;
  }
  exports_.add_status(link, shown);
  exports_.add_kept(link, shown);
  imports_.add_status(link, shown);
  service_exports_.add_status(link, shown);
  service_imports_.add_status(link, shown);
  missing_.add_status(link, shown);
  for (auto& topic : shown.topics) link.add_past(topic);
  std::erase_if(shown.peer_findings, [&](const PeerFinding& finding) {
    return !finding.name.empty() && !crosses(finding.name, shown);
  });
  shown.sum_up();
  return shown;
}

std::optional<LinkStatus> Side::status_of(LinkId link, const Now& now) const {
  const auto found = links_.all().find(link);
  if (found == links_.all().end()) return std::nullopt;
  return status_of(found->second, now);
}

std::vector<LinkId> Side::links() const {
  std::vector<LinkId> all;
  for (const auto& [id, link] : links_.all()) all.push_back(id);
  return all;
}

Status Side::own_status() const {
  Status status;
  links_.add_status(status);
  status.memory_bytes = exports_.memory_bytes() + imports_.memory_bytes() +
                        service_exports_.memory_bytes() + service_imports_.memory_bytes();
  status.made_unanswered = service_imports_.unanswered;
  status.served_unanswered = service_exports_.unanswered;
  status.shared_bytes = links_.memory().used();
  status.shared_bytes_max = options_.account.memory_bytes_max;
  for (const auto& [id, link] : links_.all()) status.memory_bytes += link.memory_bytes();
  return status;
}

Status Side::status(const Now& now) const {
  Status status = own_status();
  for (const auto& [id, link] : links_.all()) status.links.push_back(status_of(link, now));
  return status;
}

}  // namespace connect_bridge
