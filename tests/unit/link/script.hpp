// Words for tests of one link: records and frames in, events as one line of text out.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <utility>
#include <variant>

#include "core/base/overloaded.hpp"
#include "core/link/connection.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::link_test {

using flow_test::joined;
using flow_test::line_of;
using flow_test::now_ms;

inline Token128 token(std::uint8_t n) {
  Token128 result;
  result.bytes.fill(n);
  return result;
}
inline constexpr std::uint8_t kOwn = 1;
inline constexpr std::uint8_t kPeer = 2;
inline constexpr std::uint8_t kSession = 9;

inline ConnectionOptions options(bool server) {
  ConnectionOptions result;
  result.server = server;
  result.side = token(kOwn);
  result.node = "/own";
  result.login_method = "token";
  result.credential = {'p', 'w'};
  result.login_timeout = std::chrono::seconds(5);
  result.dead_after = std::chrono::seconds(3);
  return result;
}

inline Bytes hello(std::uint8_t side = kPeer, std::uint8_t session = 0) {
  return encode(Hello{kProtocolVersion, kProtocolVersion, token(side), token(session), "/peer"});
}
inline Bytes login(const std::string& method = "token") {
  return encode(Login{method, {'s', 'e', 'c', 'r', 'e', 't'}});
}
inline Welcome a_welcome(std::uint8_t side = kPeer) {
  Welcome result;
  result.side = token(side);
  result.session = token(kSession);
  result.node = "/peer";
  return result;
}

// A packet of one frame; `part` is the part of a message or part frame.
inline Bytes bytes_of(const Frame& frame, ByteView part = {}) {
  Bytes bytes;
  append_header(frame, bytes);
  bytes.insert(bytes.end(), part.begin(), part.end());
  return bytes;
}
inline Bytes message(std::uint32_t channel, std::uint32_t sequence, std::size_t size,
                     std::size_t first = SIZE_MAX) {
  const Bytes body(size, 7);
  MessageFrame frame;
  frame.channel = {channel};
  frame.subject = {1};
  frame.sequence = sequence;
  frame.raw_bytes = frame.body_bytes = static_cast<std::uint32_t>(size);
  frame.part = ByteView(body).first(std::min(size, first));
  return bytes_of(frame, frame.part);
}
inline Bytes part(std::uint32_t channel, std::size_t size) {
  const Bytes body(size, 7);
  return bytes_of(PartFrame{{channel}, false, body}, body);
}
inline Bytes abort_of(std::uint32_t channel) {
  return bytes_of(PartFrame{{channel}, true, {}});
}
inline Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// Notes as words what an open connection tells: "clock", "control", "message 1#5:100".
class Recorder final : public ConnectionUser {
 public:
  [[nodiscard]] bool wants(ChannelId, std::uint16_t) const override { return true; }
  [[nodiscard]] bool expects(ChannelId channel) const override {
    return expected.contains(channel);
  }
  Result<Nothing> on_control(Control&, const Now&) override { return note("control"); }
  Result<Nothing> on_message(InMessage message, const Now&) override {
    return note("message " + std::to_string(message.channel.value) + "#" +
                std::to_string(message.sequence) + ":" + std::to_string(message.body.size()));
  }
  void on_delivered(const Outbox::Delivered& whole, const Now&) override {
    note("delivered " + std::to_string(whole.channel.value) + "." +
         std::to_string(whole.subject.value));
  }
  void on_peer_time(const TimeReply&, Stamp) override { note("clock"); }

  Nothing note(const std::string& word) {
    words += (words.empty() ? "" : ", ") + word;
    return {};
  }

  std::string words;
  std::set<ChannelId> expected;
};

// A connection whose inputs return what followed, "ask token", "open", "failed 4002" or what a
// Recorder notes; "-" for nothing. Time in milliseconds.
class Script {
 public:
  explicit Script(bool server) : Script(options(server)) {}
  explicit Script(const ConnectionOptions& options)
      : link(options, ConnectionId{1}, "10.0.0.2:4", now_ms(0)) {}

  std::string binary(const Bytes& packet) { return packet_in(false, packet); }
  std::string text(const std::string& text) {
    return packet_in(true, Bytes(text.begin(), text.end()));
  }
  std::string authenticated(const std::string& identity = "anna") {
    link.on_authenticated(Identity{identity, {}, 0}, token(kSession), now_ms(at));
    return take();
  }
  // Lets the time pass up to `ms`, with a call at every deadline.
  std::string pass(std::int64_t ms) {
    for (auto next = link.deadline(); next && *next <= now_ms(ms).steady; next = link.deadline()) {
      at = std::max(at, (*next - TimePoint{}) / std::chrono::milliseconds(1));
      link.on_time(now_ms(at));
    }
    at = ms;
    return take();
  }
  // All packets that the link would send now, one line each.
  std::string sent() {
    std::string lines;
    while (const auto packet = link.next_packet(now_ms(at))) lines += line_of(*packet) + "\n";
    return lines;
  }
  std::string send(std::string text) {
    link.send(std::move(text));
    return take();
  }

  // The peer may send on this channel; and may no longer.
  void expect(std::uint32_t channel) { user_->expected.insert({channel}); }
  void forget(std::uint32_t channel) {
    user_->expected.erase({channel});
    link.forget_incoming({channel});
  }

  Connection link;
  std::int64_t at = 0;

 private:
  std::string packet_in(bool text, const Bytes& packet) {
    link.on_packet(text, Payload::copy_of(packet), now_ms(at));
    return take();
  }
  std::string take() {
    if (const auto asked = link.take_login()) user_->note("ask " + asked->method);
    if (link.failure() && !std::exchange(failed_, true))
      user_->note("failed " + std::to_string(static_cast<int>(link.failure()->code)));
    if (link.open() && !std::exchange(opened_, true)) {
      link.carry(*user_);
      user_->note("open");
    }
    const std::string words = std::exchange(user_->words, "");
    return words.empty() ? "-" : words;
  }

  std::unique_ptr<Recorder> user_ = std::make_unique<Recorder>();
  bool opened_ = false;
  bool failed_ = false;
};

// Scripts that have come to a state.
inline Script await_login() {
  Script script(true);
  EXPECT_EQ(script.binary(hello()), "-");
  return script;
}
inline Script authenticating() {
  auto script = await_login();
  EXPECT_EQ(script.binary(login()), "ask token");
  return script;
}
inline Script open_server() {
  auto script = authenticating();
  EXPECT_EQ(script.authenticated(), "open");
  EXPECT_TRUE(script.link.next_packet(now_ms(0)));  // welcome
  return script;
}
inline Script open_client() {
  Script script(false);
  EXPECT_TRUE(script.link.next_packet(now_ms(0)));  // hello
  EXPECT_TRUE(script.link.next_packet(now_ms(0)));  // login
  EXPECT_EQ(script.binary(encode(a_welcome())), "open");
  return script;
}

}  // namespace connect_bridge::link_test
