// Connects to one of several addresses of a name, of which some may not answer (RFC 8305, "Happy
// Eyeballs").
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "net/tcp/transport.hpp"

namespace connect_bridge {

// Connects to the first address that answers. Attempts begin in the order of the addresses, one
// every kAttemptDelay, or at once when one fails. An address that is silent for kPatience gets
// further, short attempts beside the first: the kernel repeats a lost SYN only after a second and
// more, and the link must be back as soon as the network is. An address that refuses is not tried
// again. Thread: that of the io_context.
class Race : public std::enable_shared_from_this<Race> {
 public:
  using Endpoint = asio::ip::tcp::endpoint;
  // The connected socket, or the last error when every address has refused.
  using Done = std::function<void(std::optional<TcpSocket>, const ErrorCode&)>;

  static constexpr std::size_t kAddressesMax = 16;
  static constexpr std::chrono::milliseconds kAttemptDelay{250};  // RFC 8305 section 5
  // Time until an address gets another attempt, and the length of that attempt. Beside these, one
  // attempt always goes on for kAttemptTime, for paths on which an answer takes long.
  static constexpr std::chrono::seconds kPatience{1};
  static constexpr std::chrono::seconds kAttemptTime{5};

  // The order of the attempts: address families alternate, beginning with that of the first address
  // (RFC 8305 section 4); addresses beyond kAddressesMax are left out.
  [[nodiscard]] static std::vector<Endpoint> in_turns(const std::vector<Endpoint>& addresses);

  // `slow`: an address gets another attempt only every kPatience.
  explicit Race(asio::io_context& io, bool slow = false) : io_(io), pace_(io), slow_(slow) {}
  // Starts the race; call this once, with at least one address. `done` is called once, never from
  // inside this call. The race goes on while an address does not answer.
  void start(const std::vector<Endpoint>& addresses, Done done);
  // Stops the race: `done` is not called any more.
  void stop();

 private:
  struct Attempt;
  using Clock = asio::steady_timer::clock_type;
  struct Waiting {
    Endpoint address;
    Clock::time_point due;  // earliest time of the next attempt
    Clock::duration time;   // limit of that attempt
  };

  void begin_next();
  void begin(const Waiting& next);
  void forget(const Endpoint& address);
  void on_end(const std::shared_ptr<Attempt>& attempt, ErrorCode error);
  void finish(std::optional<TcpSocket> winner, const ErrorCode& error);

  asio::io_context& io_;
  asio::steady_timer pace_;
  const bool slow_;
  std::deque<Waiting> waiting_;
  std::set<std::shared_ptr<Attempt>> running_;
  Done done_;
};

}  // namespace connect_bridge
