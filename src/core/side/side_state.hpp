// The parts of a side and how inputs reach them. Included by side*.cpp only.
#pragma once

#include <map>
#include <memory>

#include "core/side/claims.hpp"
#include "core/side/clock_publisher.hpp"
#include "core/side/dialer.hpp"
#include "core/side/exports.hpp"
#include "core/side/graph_view.hpp"
#include "core/side/imports.hpp"
#include "core/side/side.hpp"

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
  template <class ServiceInput>
  void on(ServiceInput&, const Now&) {}  // services are not forwarded yet
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
  Result<Nothing> on_link_event(LinkEntry& entry, LinkEvent& event, const Now& now);
  Result<Nothing> on_control(LinkEntry& entry, Control& control, const Now& now);
  void end_link(LinkEntry& entry, const Error& error, const Now& now);
  void publish_claim(const Now& now);

  // Connections and links (side_links.cpp).
  struct Pending {
    std::unique_ptr<Link> link;
    LinkEvents events;
  };
  LinkOptions link_options();
  LinkEntry* entry_of(ConnectionId connection);
  void close(ConnectionId connection, CloseCode code, const std::string& reason);
  void fail_pending(ConnectionId connection, CloseCode code, const std::string& reason,
                    const Now& now);
  LinkEntry* entry_for_login(const Link& link, const Identity& identity, const Now& now);
  [[nodiscard]] bool left_for_good(std::optional<std::uint16_t> code) const;
  void attach(LinkEntry& entry, std::unique_ptr<Link> link, const Now& now);
  void send_accepts(LinkEntry& entry) const;
  void detach(LinkEntry& entry, bool dead, const Now& now);
  void keep_counts(LinkEntry& entry);
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
  GraphView graph;
  Claims claims;
  LinkTable links;
  std::map<ConnectionId, Pending> pending;  // connections before login or welcome
  Dialer dialer;
  ConnectionId dialing;  // client: dial or connection under way
  Exports exports;
  Imports imports;
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
