// One process of the bridge: its rules, its graph, and the links to its peers. The whole behaviour
// of ROS2 Connect between a socket and a ROS graph; docs/architecture.md section "The loop".
// One unit: a table of inputs and the order of their receivers, without logic of its own.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/base/random.hpp"
#include "core/flow/packet.hpp"
#include "core/graph/claims_topic.hpp"
#include "core/graph/local_graph.hpp"
#include "core/graph/side_view.hpp"
#include "core/jobs/jobs.hpp"
#include "core/link/links.hpp"
#include "core/mirrors/clock_publisher.hpp"
#include "core/mirrors/local_listeners.hpp"
#include "core/mirrors/peer_topics.hpp"
#include "core/ports/ports.hpp"
#include "core/ports/status.hpp"
#include "core/services/local_services.hpp"
#include "core/services/peer_services.hpp"
#include "core/side/missing.hpp"
#include "core/side/offering.hpp"
#include "core/side/options.hpp"
#include "core/topics/drive_switch.hpp"
#include "core/topics/local_topics.hpp"

namespace connect_bridge {

// Deterministic: the same seed and inputs give the same actions. Use: handle() one input, then
// drain next_action() and, for each connection of take_ready(), next_packet(); then wait for the
// next input or next_deadline(). Single-threaded. Never throws, never blocks.
//
// Each input goes to the part that it concerns. If it concerns several parts (an offer, new rules,
// a lost link), the order is decided here.
class Side final : private LinkUser {
 public:
  // `started`: the system clock now. If two bridges of one graph claim the same, the one that
  // started first keeps it (core/graph/claims.hpp).
  Side(SideOptions options, std::uint64_t seed, Stamp started);
  Side(const Side&) = delete;
  Side& operator=(const Side&) = delete;

  void handle(Input input, const Now& now);
  // The packet waits until take_turn() gives it. Then handle() gets it, before the next packet of
  // its connection comes.
  void on_arrival(PacketReceived packet, const Now& now) {
    links_.on_arrival(std::move(packet), now);
  }
  // The packet that handle() gets now: its identity has used least of the loop's time. nullopt: no
  // packet waits.
  std::optional<PacketReceived> take_turn(const Now& now) { return links_.take_turn(now); }
  [[nodiscard]] bool packets_wait() const { return links_.packets_wait(); }
  // The loop time that the last handle(), next_packet() or action took.
  void spent(Duration cost, TimePoint now) { outputs_.spent(cost, now); }
  std::optional<Action> next_action() { return outputs_.next(); }
  // The next WebSocket message for this connection. Called when the previous one has been handed to
  // the socket.
  std::optional<Packet> next_packet(ConnectionId connection, const Now& now,
                                    const Repairs& repairs = {}) {
    outputs_.begin_step();
    return links_.next_packet(connection, now, repairs);
  }
  // A connection that may have a packet since the last input, each once; nullopt: there is no other
  // one. Besides, next_packet() is called only after a packet that announces more.
  std::optional<ConnectionId> take_ready() { return links_.take_ready(); }
  // When handle(TimePassed) must be called at the latest; nullopt: not needed.
  [[nodiscard]] std::optional<TimePoint> next_deadline() const;
  [[nodiscard]] Status status(const Now& now) const;
  // The status in parts, each of which takes little time: everything but the links, and each link.
  // status_of(): nullopt if the link is gone.
  [[nodiscard]] Status own_status() const;
  [[nodiscard]] std::vector<LinkId> links() const;
  [[nodiscard]] std::optional<LinkStatus> status_of(LinkId link, const Now& now) const;

 private:
  // ---- inputs
  void on(GraphChanged& input, const Now& now);
  void on(MessageTaken& input, const Now& now);
  void on(MessagesLost& input, const Now& now) { exports_.on_lost(input, now); }
  void on(SubscriptionFailed& input, const Now& now);
  void on(MirrorMade& input, const Now&) { imports_.on_mirror_made(input); }
  void on(MirrorFailed& input, const Now& now);
  void on(PublishFailed& input, const Now&) { imports_.on_publish_failed(input); }
  void on(QosIncompatible& input, const Now&) { exports_.on_incompatible(input); }
  void on(RequestTaken& input, const Now& now);
  void on(TypeDiffers& input, const Now&) { imports_.on_type_differs(input); }
  void on(CallersGone& input, const Now& now) { service_imports_.on_callers_gone(input, now); }
  void on(ServiceMirrorFailed& input, const Now& now);
  void on(ServiceTypeDiffers& in, const Now& now) { service_imports_.on_type_differs(in, now); }
  void on(JobDone& input, const Now& now) { jobs_.on_done(input, now); }
  void on(PolicyChanged& input, const Now& now);
  void on(LimitsChanged& input, const Now& now);
  void on(FindingsMade& input, const Now& now);
  void on(TrafficCounted& input, const Now& now) { links_.on(input, now); }
  void on(StopRequested& input, const Now& now);
  void on(TimePassed& input, const Now& now);
  // Inputs about connections and logins.
  void on(ConnectionOpened& input, const Now& now) { links_.on(input, now); }
  void on(DialFailed& input, const Now& now) { links_.on(input, now); }
  void on(PacketReceived& input, const Now& now) { links_.on(input, now); }
  void on(ConnectionClosed& input, const Now& now) { links_.on(input, now); }
  void on(NetworkChanged& input, const Now& now) { links_.on(input, now); }
  void on(Authenticated& input, const Now& now) { links_.on(input, now); }
  void on(IdentitiesChanged& input, const Now& now) { links_.on(input, now); }
  void on(CredentialChanged& input, const Now& now) { links_.on(input, now); }
  // Inputs about clients of real services.
  void on(ServiceReady& input, const Now& now) { service_exports_.on(input, now); }
  void on(ResponseTaken& input, const Now& now) { service_exports_.on(input, now); }
  void on(InvocationFailed& input, const Now& now) { service_exports_.on(input, now); }
  void on(ServiceClientFailed& input, const Now& now) { service_exports_.on(input, now); }

  // ---- reports of the links
  Result<Nothing> on(Link& link, const Offer& offer, const Now& now) override;
  Result<Nothing> on(Link& link, Accepts accepts, const Now& now) override;
  Result<Nothing> on(Link& link, const Listeners& listeners, const Now& now) override {
    missing_.on_change(now);
    return exports_.on_listeners(link, listeners, now);
  }
  Result<Nothing> on(Link& link, const Ask& ask, const Now& now) override {
    return missing_.on_ask(link, ask, now);
  }
  Result<Nothing> on(Link& link, const Answered& answer, const Now& now) override {
    return missing_.on_answer(link, answer, now);
  }
  Result<Nothing> on(Link& link, const Renew& renew, const Now& now) override;
  Result<Nothing> on(Link& link, const Renewed& renewed, const Now&) override {
    if (options_.role == Role::kClient) links_.renewed(link, renewed.accepted);
    return Nothing{};
  }
  void on_identity_changed(Link& link, const Now& now) override;
  void on_peer_time(Link& link, const TimeReply& reply, const Now& now) override {
    if (link.id == clock_from_) clock_publisher_.on_reply(reply, now.system);
    imports_.on_clock(link, now);
  }
  void on_link_open(Link& link, const Now& now) override;
  void on_peer_replaced(Link& link, const Now& now) override;
  [[nodiscard]] bool on_link_lost(Link& link, const Now& now) override;
  [[nodiscard]] bool on_link_dead(Link& link, const Now& now) override;
  [[nodiscard]] bool resumes(const Link& link) const override {
    return !link.arrived.empty() || !link.published.empty() || exports_.keeps(link.id) ||
           service_imports_.keeps(link.id);
  }
  void on_link_forgotten(Link& link, const Now& now) override;
  void on_session_forgotten(Link& link, const Now& now) override;
  void on_offers_over(Link& link, const Now& now) override;

  // Takes a channel that the peer offers. Errors: kIllegal for a number that is in use, kTooLarge
  // beyond `channels_max`.
  Result<Nothing> take(Link& link, const ChannelOffer& channel, const Now& now);
  [[nodiscard]] bool may_give_time(const Link& link) const;
  void take_time_of(Link& link, const Now& now);
  void end_time_of_peer(const Now& now);
  void settle(const Now& now);
  void follow(FollowUp what, const Now& now);
  void follow_clock();
  void hold_actions(const Now& now);
  void publish_claim(const Now& now);
  void on_claims(const Now& now);
  void tell_same_graph(const Link& link);
  void on_graph(const GraphDifference& difference, const Now& now);
  void update_exports(const Now& now);  // the graph, or claims of other bridges, have changed
  void recheck(const std::vector<Link*>& links, const Now& now);
  void recheck(const Now& now) { recheck(all_of(links_.all()), now); }
  // Only what belongs to actions that have become whole, or are not any longer: some in each step.
  void recheck_actions(const Now& now);
  void recheck(InterfaceKind kind, const std::string& name, const Now& now);
  void recheck_rights(const Now& now);
  void send_accepts(Link& link);
  void tell_rights(Link& link, const Now& now);
  void end_work(Link& link, const Now& now);
  [[nodiscard]] std::vector<ChannelFacts> channels_of(const Link& link) const;
  void look_for_missing(const Now& now);
  [[nodiscard]] LinkStatus status_of(const Link& link, const Now& now) const;

  SideOptions options_;
  Random random_;
  Token128 side_;
  Policy policy_;
  Outputs outputs_;
  Jobs jobs_;
  LocalGraph local_;
  LocalActions actions_;
  std::set<std::string> changed_actions_;      // not rechecked yet
  std::optional<TimePoint> actions_go_on_at_;  // when more of them are; none: there are none
  Links links_;
  SideView view_;
  LocalTopics exports_;
  PeerTopics imports_;
  LocalListeners local_listeners_;
  LocalServices service_exports_;
  PeerServices service_imports_;
  Offering offering_;
  Missing missing_;
  ClockPublisher clock_publisher_;
  LinkId clock_from_{};  // the link whose peer gives the time
  ClaimsTopic claims_topic_;
  DriveSwitch drive_switch_;
  bool started_ = false;
  bool stopping_ = false;
  bool follows_clock_ = false;
};

}  // namespace connect_bridge
