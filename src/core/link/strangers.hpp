// Unauthenticated connections, which carry no link yet.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "core/base/address_paces.hpp"
#include "core/base/log_limit.hpp"
#include "core/connection/connection.hpp"
#include "core/link/options.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"
#include "core/ports/status.hpp"

namespace connect_bridge {

// A server's connections before their login is answered, and a client's before its welcome. Their
// number is limited: when all places are taken, the oldest connection is closed. Answers that must
// come late wait here, at most until the time for the login is over. Single-threaded; owned by
// Links.
class Strangers {
 public:
  Strangers(const LinkOptions& options, Outputs& outputs);

  void add(ConnectionOptions options, const ConnectionOpened& opened, const Now& now);
  // Null: the connection is not here.
  [[nodiscard]] Connection* find(ConnectionId connection) const;
  // The customer whose turns an unauthenticated connection takes. The connection must be here.
  [[nodiscard]] const std::string& customer_of(ConnectionId connection) const {
    return places_.at(connection).customer;
  }
  // The connection carries a link from now on, or is gone. Null: it was not here.
  std::unique_ptr<Connection> take(ConnectionId connection);
  // Closes the connection, and counts it by this code. The reason is logged; the peer gets the same
  // words, or only `sent`.
  void refuse(ConnectionId connection, const Error& why, const Now& now,
              const std::string& sent = {});
  void close_all(CloseCode code, const std::string& reason);

  // The login method's answer for a connection that is here. `not_before`: when it may be let in.
  // True: the answer waits, and take_due() returns it later. A right login waits until
  // `not_before`. A wrong one waits as long as possible if there are too many, of its address or of
  // all.
  [[nodiscard]] bool puts_off(Authenticated& answer, TimePoint not_before, const Now& now);
  std::optional<Authenticated> take_due(const Now& now);
  // The login method reports changes by itself: they hold for waiting logins, too.
  void take_changes(const IdentitiesChanged& changed);

  void on_time(const Now& now);
  // A connection that has failed, if there is any.
  [[nodiscard]] std::optional<ConnectionId> failed() const;
  [[nodiscard]] std::optional<TimePoint> deadline() const;
  [[nodiscard]] StrangersStatus status() const;

 private:
  struct Place {
    std::unique_ptr<Connection> connection;
    std::string address;  // the address that limits count; empty: none do
    int share = 1;
    std::string customer;
    std::optional<Authenticated> answer;  // put off
    TimePoint due{};                      // when the answer is given
  };

  // Closes the connection without counting it.
  void end(ConnectionId connection, const Error& why, const Now& now, const std::string& sent = {});
  [[nodiscard]] bool is_one_too_many(const Place& wrong, const Now& now);

  const LinkOptions& options_;
  Outputs& outputs_;
  std::map<ConnectionId, Place> places_;  // ids rise: the oldest first
  AddressPaces address_wrong_logins_;
  Pace wrong_logins_;
  LogLimit refusals_;
  StrangersStatus counts_;
};

}  // namespace connect_bridge
