// A link as the side knows it: it outlives its connections.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "core/base/log_limit.hpp"
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
  std::uint32_t offered = 0;           // channels the peer offers on this connection
  TimePoint withdrawals_paid_until{};  // every mirror that comes and goes takes a while
  Token128 peer_side;                  // of the last connection
  std::string address;                 // of the last connection, for people
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
  // Notes why the peer declines a channel. Whether that is worth a line: the first time of a
  // channel it is, later ones are now and then.
  bool note_decline(std::string& declined, const Decline& decline, const Now& now) {
    std::string reason = decline.reason.empty() ? "no reason given" : decline.reason;
    if (declined == reason) return false;
    return std::exchange(declined, std::move(reason)).empty() || declines.count(now);
  }
  // "node at address", for log lines.
  [[nodiscard]] std::string label() const { return node + " at " + address; }
};

using LinkTable = std::map<LinkId, Link>;

}  // namespace connect_bridge
