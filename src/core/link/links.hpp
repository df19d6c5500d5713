// All links of a side: their connections, logins and losses, and when a client connects again.
// One unit: the session that a login continues, the link that is lost and the next attempt follow
// from one table of links and connections.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "core/base/random.hpp"
#include "core/base/timers.hpp"
#include "core/link/dialer.hpp"
#include "core/link/due_links.hpp"
#include "core/link/last_failure.hpp"
#include "core/link/link.hpp"
#include "core/link/loop_turns.hpp"
#include "core/link/options.hpp"
#include "core/link/renewal.hpp"
#include "core/link/strangers.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// A session is a link: a client that presents its secret continues it on another connection. A
// lost link waits `dead_after` for that; then it is dead, and waits on only for what resumes.
// Single-threaded; owned by the side.
class Links {
 public:
  // `side` is our own id.
  Links(const LinkOptions& options, Token128 side, Random& random, Outputs& outputs,
        LinkUser& user);

  void on(ConnectionOpened& input, const Now& now);
  void on(DialFailed& input, const Now& now);
  void on(PacketReceived& input, const Now& now);
  void on(ConnectionClosed& input, const Now& now);
  void on(NetworkChanged& input, const Now& now);
  void on(Authenticated& input, const Now& now);
  void on(IdentitiesChanged& input, const Now& now);
  void on(CredentialChanged& input, const Now& now);
  void on(const LimitsChanged& input) {
    for (auto& [id, link] : links_) link.limit(input);
  }
  void renewed(Link& link, bool accepted) { renewal_.on_renewed(link, accepted); }
  void on_time(const Now& now);
  // Looks at the links that the input concerned, to be called after each: closes the connections
  // that have failed, notes who has something to send and who waits for when. Whether any failed.
  bool settle(const Now& now);
  // A packet of this connection has come, and waits until it is given by take_turn().
  void on_arrival(ConnectionId connection, const Now& now);
  // Whose packet is read next, by PacketReceived; nullopt: no packet waits.
  std::optional<ConnectionId> take_turn(const Now& now) { return turns_.take(now.steady); }
  // Client: dials when it is time to.
  void dial_if_due(const Now& now);
  // Closes everything orderly, for good.
  void stop(const Now& now);

  std::optional<Packet> next_packet(ConnectionId id, const Now& now, const Repairs& repairs = {});
  // A connection that has something to send, once after each input that may have brought it; then
  // next_packet() gives it.
  std::optional<ConnectionId> take_ready() { return due_.take_ready(); }
  [[nodiscard]] std::optional<TimePoint> deadline() const {
    const auto first = earliest(accounts_.appearing().deadline(),
                                earliest(strangers_.deadline(), due_.deadline()));
    return options_.role == Role::kClient ? earliest(first, dialer_.deadline()) : first;
  }

  // Those of living links and of lost ones.
  [[nodiscard]] LinkTable& all() { return links_; }
  [[nodiscard]] const LinkTable& all() const { return links_; }
  // Memory that their peers use at this side, in bytes.
  [[nodiscard]] Budget& memory() { return accounts_.memory(); }
  [[nodiscard]] const Budget& memory() const { return accounts_.memory(); }
  void add_status(Status& status) const {
    status.last_failure = last_failure_.last();
    status.strangers = strangers_.status();
  }

 private:
  [[nodiscard]] ConnectionOptions connection_options() const;
  // Null: it carries no link.
  [[nodiscard]] Link* link_of(ConnectionId connection) const {
    const auto it = carrying_.find(connection);
    return it == carrying_.end() ? nullptr : it->second;
  }
  void answer_login(Authenticated& answer, const Now& now);
  // The link whose session the client continues, if it is its own.
  [[nodiscard]] Link* continued_by(const Connection& connection, const Identity& identity);
  // That, or a new one; null at the limit.
  [[nodiscard]] Link* link_for_login(const Connection& connection, const Identity& identity,
                                     NameMap names, const Now& now);
  // Makes room for one more among the links that `counts` counts: a lost link is removed for one
  // that is present. False: there is no room.
  template <class Counts>
  [[nodiscard]] bool make_room(std::size_t links_max, const Now& now, Counts counts);
  [[nodiscard]] Link& make_link(const std::string& identity, NameMap names);
  void close(ConnectionId connection, CloseCode code, const std::string& reason) {
    outputs_.push(CloseConnection{connection, code, reason});
  }
  // What a connection before its login has come to by the last input.
  void look_at(Connection& stranger, const Now& now);
  // The log gets the reason; the peer gets the same words, or only `told`.
  void refuse(ConnectionId stranger, const Error& why, const Now& now,
              const std::string& told = {});
  void carry(Link& link, std::unique_ptr<Connection> connection, const Now& now);
  // The connection is gone, or about to be; `loss`: what that means.
  void lose(Link& link, Loss loss, const Now& now, DialFailure failure = DialFailure::kGone);
  void end(Link& link, const Now& now);  // it is dead
  void close_failed(Link& link, const Now& now);
  // Whether what the link has to send waits for packets that have come from those who have used
  // less of the loop's time. It is ready again soon.
  [[nodiscard]] bool sends_later(const Connection& connection, const LoopTime& payer,
                                 const Now& now) {
    if (connection.may_wait() &&  // mutant: packets_later
        turns_.come_before(payer, due_.later(connection.id(), now.steady), now.steady))
      return true;
    due_.not_later(connection.id());
    return false;
  }
  void wait(Link& link) { due_.wait(link.id, link.timer, link.deadline()); }
  void on_time(Link& link, const Now& now);
  void dial_later(DialFailure failure, const Now& now);
  // A line about a link that came or goes, unless its identity has caused too many.
  void log(const Link& link, LogLevel level, std::string text, const Now& now);

  const LinkOptions& options_;
  Token128 side_;
  Random& random_;
  Outputs& outputs_;
  LinkUser& user_;
  Accounts accounts_;
  DueLinks due_;  // before the links, whose timers are there
  LinkTable links_;
  // Exactly the connections of these: carry() adds one, lose() removes it. The others are
  // strangers.
  std::map<ConnectionId, Link*> carrying_;
  LoopTurns turns_;
  const Payer of_strangers_ = std::make_shared<LoopTime>();
  Strangers strangers_;
  Dialer dialer_;
  ConnectionId dialing_;  // client: dial or connection under way
  std::uint64_t last_link_ = 0;
  std::uint64_t last_connection_ = 0;  // client
  bool stopped_ = false;
  LastFailure last_failure_;  // of a connection, at a server: of a link
  Renewal renewal_;
};

}  // namespace connect_bridge
