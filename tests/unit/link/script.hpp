// Words for tests of one link: records and frames in, events as one line of text out.
#pragma once

#include <memory>
#include <string>

#include "core/connection/connection.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::link_test {

using flow_test::joined;
using flow_test::line_of;
using flow_test::now_ms;

inline constexpr std::uint8_t kOwn = 1;
inline constexpr std::uint8_t kPeer = 2;
inline constexpr std::uint8_t kSession = 9;
Token128 token(std::uint8_t n);

ConnectionOptions options(bool server);

Bytes hello(std::uint8_t side = kPeer, std::uint8_t session = 0);
Bytes login(const std::string& method = "token");
Welcome a_welcome(std::uint8_t side = kPeer);

// A packet of one frame; `part` is the part of a message or part frame.
Bytes bytes_of(const Frame& frame, ByteView part = {});
Bytes message(std::uint32_t channel, std::uint32_t sequence, std::size_t size,
              std::size_t first = SIZE_MAX);
Bytes part(std::uint32_t channel, std::size_t size);
Bytes abort_of(std::uint32_t channel);
Bytes operator+(Bytes a, const Bytes& b);

class Recorder;

// A connection whose inputs return what followed, "ask token", "open", "failed 4002" or what an
// open connection reports to its user: "clock", "control", "message 1#5:100"; "-" for nothing. Time
// in milliseconds.
class Script {
 public:
  explicit Script(bool server);
  explicit Script(const ConnectionOptions& options);
  Script(Script&&);
  ~Script();

  std::string binary(const Bytes& packet);
  std::string text(const std::string& text);
  std::string authenticated(const std::string& identity = "anna");
  // Lets the time pass up to `ms`, with a call at every deadline.
  std::string pass(std::int64_t ms);
  // All packets that the link would send now, one line each.
  std::string sent();
  std::string send(std::string text);

  // The peer may send on this channel; and may no longer.
  void expect(std::uint32_t channel);
  void forget(std::uint32_t channel);
  // It ends with its next message.
  void expect_one(std::uint32_t channel);
  // May texts be decompressed?
  void reads_texts(bool may);
  // It has ended here; the peer may still send on it.
  void let_go(std::uint32_t channel);

  Connection link;
  std::int64_t at = 0;

 private:
  std::string packet_in(bool text, const Bytes& packet);
  std::string take();

  std::unique_ptr<Recorder> user_;
  bool opened_ = false;
  bool failed_ = false;
};

// Scripts that have come to a state.
Script await_login();
Script authenticating();
Script open_server();
Script open_client();

}  // namespace connect_bridge::link_test
