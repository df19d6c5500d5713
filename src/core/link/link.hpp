// A link as the side knows it: it outlives its connections.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "core/base/log_limit.hpp"
#include "core/base/pace.hpp"
#include "core/link/channel.hpp"
#include "core/link/connection.hpp"
#include "core/ports/status.hpp"

namespace connect_bridge {

struct Link {
  LinkId id;
  std::unique_ptr<Connection> connection;  // null while the connection is lost
  ConnectionEvents events;                 // what the link said and the side has not handled yet
  Token128 session;
  Identity identity;
  std::optional<Accepts> accepts;  // what the peer would import; known after its first message
  bool offers_complete = false;    // our first round of offers has been sent
  std::optional<TimePoint> orphans_end_at;  // open again: what was not offered again by then ends
  TimePoint opened_at{};
  std::optional<TimePoint> forgotten_at;  // lost: when the link is declared dead
  LogLimit declines;                      // of channels that were declined before
  std::uint64_t connects = 0;
  std::uint32_t last_channel = 0;
  std::uint32_t offered = 0;  // channels the peer offers on this connection
  // What a peer offers and withdraws again costs this graph endpoints that come and go.
  Pace withdrawals{12'000, std::chrono::milliseconds(5)};
  Token128 peer_side;   // of the last connection
  std::string address;  // of the last connection, for people
  std::string node;
  // What was counted on its earlier connections, by exported, topic and type.
  std::map<std::tuple<bool, std::string, std::string>, TopicStatus> past;

  [[nodiscard]] bool open() const { return connection && connection->open(); }
  void send(const Control& message) {
    if (connection) connection->send(message, events);
  }
  void send(std::string text) {
    if (connection) connection->send(std::move(text), events);
  }
  void fail(Error error) {
    events.push_back(ConnectionFailed{error.code, std::move(error.message)});
  }

  // ---- while there is a connection
  [[nodiscard]] Outbox& outbox() const { return connection->outbox(); }
  [[nodiscard]] const ClockEstimate& clock() const { return connection->clock(); }
  [[nodiscard]] std::uint32_t peer_message_bytes_max() const {
    return connection->peer().message_bytes_max;
  }

  // ---- channels of this connection, by their numbers
  // The peer offers a channel under a new number. Until somebody takes it, what comes on it is
  // dropped: as on one that was declined.
  void expect_offered(ChannelId number) {
    expect(number, nullptr);
    incoming_[number].offered = true;
    ++offered;
  }
  void take_offered(ChannelId number, IncomingChannel& channel) {
    incoming_[number].channel = &channel;
  }
  // Requests of the peer come on this number; without a channel they are dropped, until the peer
  // withdraws it.
  void expect(ChannelId number, IncomingChannel* channel) {
    incoming_[number].channel = channel;
    if (connection) connection->expect_incoming(number);
  }
  // The channel has ended here, and what the peer still sends on it is dropped.
  void let_go(ChannelId number) {
    if (const auto it = incoming_.find(number); it != incoming_.end()) it->second.channel = nullptr;
  }
  // The peer will not send on it any more.
  void forget(ChannelId number) {
    const auto it = incoming_.find(number);
    if (it == incoming_.end()) return;
    if (it->second.offered) --offered;
    incoming_.erase(it);
    if (connection) connection->forget_incoming(number);
  }
  [[nodiscard]] bool expects(ChannelId number) const { return incoming_.contains(number); }
  [[nodiscard]] bool is_offered(ChannelId number) const {
    const auto it = incoming_.find(number);
    return it != incoming_.end() && it->second.offered;
  }
  [[nodiscard]] IncomingChannel* incoming(ChannelId number) const {
    const auto it = incoming_.find(number);
    return it == incoming_.end() ? nullptr : it->second.channel;
  }
  // A new number to send on. The outbox's queue is the caller's to add and to remove.
  ChannelId open_channel(OutgoingChannel& channel) {
    const ChannelId number{++last_channel};
    outgoing_[number] = &channel;
    return number;
  }
  void close_channel(ChannelId number) { outgoing_.erase(number); }
  [[nodiscard]] OutgoingChannel* outgoing(ChannelId number) const {
    const auto it = outgoing_.find(number);
    return it == outgoing_.end() ? nullptr : it->second;
  }
  // The connection is lost, and its numbers with it.
  void forget_channels() {
    incoming_.clear();
    outgoing_.clear();
    offered = 0;
  }

  // Notes why the peer declines a channel. Whether that is worth a line: the first time of a
  // channel it is, later ones are now and then.
  bool note_decline(std::string& declined, const Decline& decline, const Now& now) {
    std::string reason = decline.reason.empty() ? "no reason given" : decline.reason;
    if (declined == reason) return false;
    return std::exchange(declined, std::move(reason)).empty() || declines.count(now);
  }
  // "node at address", for log lines.
  [[nodiscard]] std::string label() const { return node + " at " + address; }

 private:
  struct Incoming {
    IncomingChannel* channel = nullptr;  // null: what comes is dropped
    bool offered = false;                // by the peer; else the peer's requests
  };
  std::unordered_map<ChannelId, Incoming> incoming_;
  std::unordered_map<ChannelId, OutgoingChannel*> outgoing_;
};

using LinkTable = std::map<LinkId, Link>;

}  // namespace connect_bridge
