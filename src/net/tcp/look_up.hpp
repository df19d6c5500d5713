// Addresses of a name.
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

// The system's resolver blocks, half a minute where no name server answers, and nothing can
// interrupt it. So each look-up has a thread of its own, which may outlive this object and the
// io_context: neither the end of the program nor the next look-up, perhaps on another network,
// waits for it. But what it finds after all is for whoever looks up the same then, or soon after:
// where the first of two name servers is dead, every answer takes longer than a dial may. Thread:
// that of the io_context, where it is also destroyed before that ends.
class LookUp {
 public:
  using Endpoints = std::vector<asio::ip::tcp::endpoint>;
  // Blocks. Called in the other thread.
  using Resolve =
      std::function<Endpoints(const std::string& host, std::uint16_t port, ErrorCode& error)>;
  using Done = std::function<void(const ErrorCode& error, const Endpoints& found)>;

  // Resolves by the system's resolver; may block.
  static Endpoints resolve(const std::string& host, std::uint16_t port, ErrorCode& error);
  // So many look-ups may be under way in the process. A further one fails at once with try_again.
  static constexpr int kUnderWayMax = 8;
  // For how long an answer that came too late for its caller is given to the next one.
  static constexpr std::chrono::seconds kLate{30};

  explicit LookUp(asio::io_context& io, Resolve resolve = &LookUp::resolve);
  ~LookUp() { stop(); }
  LookUp(const LookUp&) = delete;
  LookUp& operator=(const LookUp&) = delete;

  // Once only. `done` is called once, never from inside.
  void start(const std::string& host, std::uint16_t port, Done done);
  // `done` is not called any more.
  void stop();

 private:
  struct Shared;
  class All;
  const std::shared_ptr<Shared> shared_;
};

}  // namespace connect_bridge
