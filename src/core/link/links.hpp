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
#include "core/link/side_cap.hpp"
#include "core/link/strangers.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// A session is a link: a client that presents its secret continues it on another connection. A lost
// link waits `dead_after` for that; then it is dead, and waits on only for messages to resume.
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
  void on(const LimitsChanged& input, const Now& now);
  void on(const TrafficCounted& input, const Now& now) {
    side_cap_.counted(input.sent_bytes, now.steady);
  }
  void renewed(Link& link, bool accepted) { renewal_.on_renewed(link, accepted); }
  // True: something of a link has ended, which may have taken long.
  [[nodiscard]] bool on_time(const Now& now);
  // Called after each input; checks the links that the input concerned. Closes failed connections,
  // and notes the connections with something to send and the deadlines. True: a connection had
  // failed.
  bool settle(const Now& now);
  // The packet waits until take_turn() gives it.
  void on_arrival(PacketReceived packet, const Now& now);
  // The packet that is handled next; nullopt: none waits.
  std::optional<PacketReceived> take_turn(const Now& now) { return turns_.take(now.steady); }
  [[nodiscard]] bool packets_wait() const { return !turns_.empty(); }
  // Client: connects when it is time to.
  void dial_if_due(const Now& now);
  // Closes all connections in order, for good.
  void stop(const Now& now);

  std::optional<Packet> next_packet(ConnectionId id, const Now& now, const Repairs& repairs = {});
  // A connection that has something to send, once after each input that may have brought it; then
  // next_packet() gives the packet.
  std::optional<ConnectionId> take_ready() { return due_.take_ready(); }
  [[nodiscard]] std::optional<TimePoint> deadline() const {
    const auto first =
        earliest(accounts_.appearing().deadline(),
                 earliest(strangers_.deadline(), earliest(side_cap_.deadline(), due_.deadline())));
    return options_.role == Role::kClient ? earliest(first, dialer_.deadline()) : first;
  }

  // Living links and lost ones.
  [[nodiscard]] LinkTable& all() { return links_; }
  [[nodiscard]] const LinkTable& all() const { return links_; }
  // Memory that the peers use at this side, in bytes.
  [[nodiscard]] Budget& memory() { return accounts_.memory(); }
  [[nodiscard]] const Budget& memory() const { return accounts_.memory(); }
  void add_status(Status& status) const {
    status.last_failure = last_failure_.last();
    status.strangers = strangers_.status();
  }

 private:
  [[nodiscard]] ConnectionOptions connection_options() const;
  // The link that this connection carries. Null: none.
  [[nodiscard]] Link* link_of(ConnectionId connection) const {
    const auto it = carrying_.find(connection);
    return it == carrying_.end() ? nullptr : it->second;
  }
  void answer_login(Authenticated& answer, const Now& now);
  // The link whose session the client continues, if the link is the client's own.
  [[nodiscard]] Link* continued_by(const Connection& connection, const Identity& identity);
  // The link this login continues, or a new one; null when there are too many.
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
  // Handles the progress that the last input brought to a connection before its login.
  void look_at(Connection& stranger, const Now& now);
  // Refuses an unauthenticated connection. The reason is logged; the peer gets the same words, or
  // only `sent`.
  void refuse(ConnectionId stranger, const Error& why, const Now& now,
              const std::string& sent = {});
  void carry(Link& link, std::unique_ptr<Connection> connection, const Now& now);
  // The connection is gone, or about to be; `loss`: the consequence for the link.
  void lose(Link& link, Loss loss, const Now& now, DialFailure failure = DialFailure::kGone);
  // All that ends with the link's connection, or with the link, begins to end. `dies`: the link.
  void begin_end(Link& link, bool dies, const Now& now);
  // Some of it ends.
  void end_some(Link& link, std::size_t entries, const Now& now);
  // The rest of it ends, before something else happens to the link.
  void end_rest(Link& link, const Now& now) {
    if (link.end.goes_on_at) end_some(link, LinkEnd::kAll, now);
  }
  void close_failed(Link& link, const Now& now);
  // The connection of a link has closed; it still counts among carrying_.
  void note_failure(const Failure& why, bool orderly, const Now& now);
  // Sets the link's highest rate: its own limit or its share of the side's.
  void cap(Link& link, double share, const Now& now);
  void divide_cap(const Now& now);
  // True: the link's packets wait for arrived packets of identities that have used less of the
  // loop's time. The connection is ready again soon.
  [[nodiscard]] bool sends_later(const Connection& connection, const LoopTime& payer,
                                 const Now& now) {
    if (packets_wait() && connection.may_wait() &&  // mutant: packets_later
        turns_.come_before(payer, due_.later(connection.id(), now.steady), now.steady))
      return true;
    due_.not_later(connection.id());
    return false;
  }
  void wait(Link& link) { due_.wait(link.id, link.timer, link.deadline()); }
  // True: something of the link has ended.
  bool on_time(Link& link, const Now& now);
  void dial_later(DialFailure failure, const Now& now);
  // Logs a line about a link that came or goes, unless its identity has caused too many.
  void log(const Link& link, LogLevel level, std::string text, const Now& now);

  const LinkOptions& options_;
  Token128 side_;
  Random& random_;
  Outputs& outputs_;
  LinkUser& user_;
  Accounts accounts_;
  DueLinks due_;  // declared before the links, which hold its timers
  LinkTable links_;
  // The connections of links_, and no others: carry() adds one, lose() removes it. All others are
  // unauthenticated.
  std::map<ConnectionId, Link*> carrying_;
  LoopTurns turns_;
  SideCap side_cap_;
  const Payer of_strangers_ = std::make_shared<LoopTime>();
  Strangers strangers_;
  Dialer dialer_;
  ConnectionId dialing_;  // client: attempt or connection under way
  std::uint64_t last_link_ = 0;
  std::uint64_t last_connection_ = 0;  // client
  bool stopped_ = false;
  LastFailure last_failure_;  // of a connection; at a server: of a link
  Renewal renewal_;
};

}  // namespace connect_bridge
