// Looks up the addresses of a name.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "net/tcp/transport.hpp"

namespace connect_bridge {

// The system's resolver blocks, half a minute if no name server answers, and nothing can interrupt
// it. So each look-up has a thread of its own, which may outlive this object and the io_context.
// Neither the end of the program nor the next look-up, perhaps on another network, waits for it. A
// late answer goes to a caller who looks up the same name then, or soon after: if the first of two
// name servers is dead, every answer takes longer than a dial may. Thread: that of the io_context,
// which also destroys this object before it ends.
class LookUp {
 public:
  using Endpoints = std::vector<asio::ip::tcp::endpoint>;
  // Blocks; called in the thread of the look-up.
  using Resolve =
      std::function<Endpoints(const std::string& host, std::uint16_t port, ErrorCode& error)>;
  using Done = std::function<void(const ErrorCode& error, const Endpoints& found)>;

  // Uses the system's resolver; may block.
  static Endpoints resolve(const std::string& host, std::uint16_t port, ErrorCode& error);
  // Number of look-ups that may be under way in the process. A further one fails at once with
  // try_again.
  static constexpr int kUnderWayMax = 8;
  // Time for which an answer that came too late for its caller stays for the next one.
  static constexpr std::chrono::seconds kLate{30};

  explicit LookUp(asio::io_context& io, Resolve resolve = &LookUp::resolve);
  ~LookUp() { stop(); }
  LookUp(const LookUp&) = delete;
  LookUp& operator=(const LookUp&) = delete;

  // Starts the look-up; call this once. `done` is called once, never from inside this call.
  void start(const std::string& host, std::uint16_t port, Done done);
  // Stops the look-up: `done` is not called any more.
  void stop();

 private:
  struct Shared;
  class All;
  const std::shared_ptr<Shared> shared_;
};

}  // namespace connect_bridge
