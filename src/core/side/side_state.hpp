// The parts of a side and how inputs reach them. Included by side*.cpp only.
#pragma once

#include <map>
#include <memory>

#include "core/graph/actions.hpp"
#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"
#include "core/jobs/jobs.hpp"
#include "core/link/dialer.hpp"
#include "core/services/service_exports.hpp"
#include "core/services/service_imports.hpp"
#include "core/side/side.hpp"
#include "core/topics/clock_publisher.hpp"
#include "core/topics/exports.hpp"
#include "core/topics/imports.hpp"

namespace connect_bridge {

struct Side::State {
  State(SideOptions given, std::uint64_t seed);

  // Inputs, one function each.
  void on(GraphChanged& input, const Now& now);
  void on(MessageTaken& input, const Now& now);
  void on(MessagesLost& input, const Now& now);
  void on(SubscriptionFailed& input, const Now& now);
  void on(MirrorFailed& input, const Now& now);
  void on(PublishFailed& input, const Now& now);
  void on(QosIncompatible& input, const Now& now);
  void on(RequestTaken& input, const Now& now);
  void on(CallersGone& input, const Now& now);
  void on(ServiceReady& input, const Now& now);
  void on(ResponseTaken& input, const Now& now);
  void on(InvocationFailed& input, const Now& now);
  void on(ServiceMirrorFailed& input, const Now& now);
  void on(ServiceClientFailed& input, const Now& now);
  void on(ConnectionOpened& input, const Now& now);
  void on(DialFailed& input, const Now& now);
  void on(PacketReceived& input, const Now& now);
  void on(ConnectionClosed& input, const Now& now);
  void on(Authenticated& input, const Now& now);
  void on(JobDone& input, const Now& now);
  void on(PolicyChanged& input, const Now& now);
  void on(StopRequested& input, const Now& now);
  void on(TimePassed& input, const Now& now);

  // What the links said while an input was handled; then demands and our claim.
  void settle(const Now& now);
  bool handle_pending_events(const Now& now);
  bool handle_link_events(const Now& now);
  Result<Nothing> on_link_event(Link& link, ConnectionEvent& event, const Now& now);
  Result<Nothing> on_control(Link& link, Control& control, const Now& now);
  void end_link(Link& link, const Error& error, const Now& now);
  void publish_claim(const Now& now);

  // Channels of all kinds (side_channels.cpp).
  void update_exports(const Now& now);  // the graph, or what other bridges claim, has changed
  void hold_actions(const Now& now);
  void send_offers(Link& link, const Now& now);
  void send_offers(const Now& now);  // to all links that are open
  void recheck(Link& link, const Now& now);
  Result<Nothing> on_offer(Link& link, const Offer& offer, const Now& now);
  Result<Nothing> on_withdraw(Link& link, const Withdraw& withdraw, const Now& now);
  Result<Nothing> on_attach(Link& link, const Attach& attach, const Now& now);
  Result<Nothing> on_message(Link& link, InMessage& message, const Now& now);
  void forget_orphans(LinkId link, const Now& now);
  void on_link_lost(Link& link, const Now& now);
  void on_link_dead(LinkId link, const Now& now);
  void end_calls(LinkId link, const Now& now);  // and the mirrors of services

  // Connections and links (side_links.cpp).
  struct Pending {
    std::unique_ptr<Connection> connection;
    ConnectionEvents events;
  };
  ConnectionOptions connection_options();
  Link* link_of(ConnectionId connection);
  void close(ConnectionId connection, CloseCode code, const std::string& reason);
  void fail_pending(ConnectionId connection, CloseCode code, const std::string& reason,
                    const Now& now);
  Link* link_for_login(const Connection& connection, const Identity& identity, const Now& now);
  [[nodiscard]] bool left_for_good(std::optional<std::uint16_t> code) const;
  void attach(Link& link, std::unique_ptr<Connection> connection, const Now& now);
  void send_accepts(Link& link) const;
  void detach(Link& link, bool dead, const Now& now);
  void keep_counts(Link& link);
  void dial_later(bool login_refused, const Now& now);
  void on_link_time(const Now& now);
  void dial_if_due(const Now& now);
  void warn_once(const std::string& text);
  Token128 new_token(bool secret);

  SideOptions options;
  Random random;
  Token128 side;
  Policy policy;
  Outputs outputs;
  Jobs jobs;
  GraphView graph;
  Claims claims;
  LocalActions actions;
  LinkTable links;
  std::map<ConnectionId, Pending> pending;  // connections before login or welcome
  Dialer dialer;
  ConnectionId dialing;  // client: dial or connection under way
  Exports exports;
  Imports imports;
  ServiceExports service_exports;
  ServiceImports service_imports;
  ClockPublisher clock_publisher;
  SubscriptionId claims_subscription;
  MirrorId claims_mirror;
  std::uint32_t last_link = 0;
  std::uint32_t last_connection = 0;  // client
  bool started = false;
  bool stopping = false;
  std::string last_failure;
  std::set<std::string> warned;
};

}  // namespace connect_bridge
