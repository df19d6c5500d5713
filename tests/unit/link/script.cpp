#include "unit/link/script.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <utility>

namespace connect_bridge::link_test {

Token128 token(std::uint8_t n) {
  Token128 result;
  result.bytes.fill(n);
  return result;
}

ConnectionOptions options(bool server) {
  ConnectionOptions result;
  result.server = server;
  result.side = token(kOwn);
  result.node = "/own";
  result.login_method = "token";
  result.credential = {'p', 'w'};
  result.login_timeout = std::chrono::seconds(5);
  result.dead_after = std::chrono::seconds(3);
  result.outbox.compressed_texts_min = std::numeric_limits<std::size_t>::max();
  return result;
}

Bytes hello(std::uint8_t side, std::uint8_t session) {
  return encode(Hello{kProtocolVersion, kProtocolVersion, token(side), token(session), "/peer"});
}
Bytes login(const std::string& method) {
  return encode(Login{method, {'s', 'e', 'c', 'r', 'e', 't'}});
}
Welcome a_welcome(std::uint8_t side) {
  Welcome result;
  result.side = token(side);
  result.session = token(kSession);
  result.node = "/peer";
  return result;
}

Bytes bytes_of(const Frame& frame, ByteView part) {
  Bytes bytes;
  append_header(frame, bytes);
  bytes.insert(bytes.end(), part.begin(), part.end());
  return bytes;
}
Bytes message(std::uint32_t channel, std::uint32_t sequence, std::size_t size, std::size_t first) {
  const Bytes body(size, 7);
  MessageFrame frame;
  frame.channel = {channel};
  frame.subject = {1};
  frame.sequence = sequence;
  frame.raw_bytes = frame.body_bytes = static_cast<std::uint32_t>(size);
  frame.part = ByteView(body).first(std::min(size, first));
  return bytes_of(frame, frame.part);
}
Bytes part(std::uint32_t channel, std::size_t size) {
  const Bytes body(size, 7);
  return bytes_of(PartFrame{{channel}, false, body}, body);
}
Bytes abort_of(std::uint32_t channel) {
  return bytes_of(PartFrame{{channel}, true, {}});
}
Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// Records as words what an open connection reports: "clock", "control", "message 1#5:100".
class Recorder final : public ConnectionUser, private IncomingChannel {
 public:
  void expect(ChannelId channel) { expected_.try_emplace(channel, Incoming{this}); }
  void expect_one(ChannelId channel) {
    expect(channel);
    last_ = channel;
  }
  void let_go(ChannelId channel) { expected_.at(channel).channel = nullptr; }
  void forget(ChannelId channel) { expected_.erase(channel); }

  [[nodiscard]] Incoming* incoming(ChannelId channel) override {
    const auto it = expected_.find(channel);
    return it == expected_.end() ? nullptr : &it->second;
  }
  Result<Nothing> on_control(Control&, const Now&) override { return note("control"); }
  bool may_read_texts(std::uint32_t, const Now&) override { return reads_texts; }
  Result<Nothing> on_message(InMessage message, const Now&) override {
    if (message.channel == last_) forget(last_);
    return note("message " + std::to_string(message.channel.value) + "#" +
                std::to_string(message.sequence) + ":" + std::to_string(message.body.size()));
  }
  void on_delivered(const Outbox::Delivered& whole, const Now&) override {
    note("delivered " + std::to_string(whole.channel.value) + "." +
         std::to_string(whole.subject.value));
  }
  void on_peer_time(const TimeReply&, const Now&) override { note("clock"); }

  Nothing note(const std::string& word) {
    words += (words.empty() ? "" : ", ") + word;
    return {};
  }

  std::string words;
  bool reads_texts = true;

 private:
  void on_withdraw(const Withdraw&, const Now&) override {}

  std::map<ChannelId, Incoming> expected_;
  ChannelId last_;
};

Script::Script(bool server) : Script(link_test::options(server)) {}
Script::Script(const ConnectionOptions& options)
    : link(options, ConnectionId{1}, "10.0.0.2:4", now_ms(0)),
      user_(std::make_unique<Recorder>()) {}
Script::Script(Script&&) = default;
Script::~Script() = default;

std::string Script::binary(const Bytes& packet) {
  return packet_in(false, packet);
}

std::string Script::text(const std::string& text) {
  return packet_in(true, Bytes(text.begin(), text.end()));
}

std::string Script::authenticated(const std::string& identity) {
  link.on_authenticated(Identity{identity, {}, 0}, token(kSession), now_ms(at));
  return take();
}

std::string Script::pass(std::int64_t ms) {
  for (auto next = link.deadline(); next && *next <= now_ms(ms).steady; next = link.deadline()) {
    at = std::max(at, (*next - TimePoint{}) / std::chrono::milliseconds(1));
    link.on_time(now_ms(at));
  }
  at = ms;
  return take();
}

std::string Script::sent() {
  std::string lines;
  while (const auto packet = link.next_packet(now_ms(at))) lines += line_of(*packet) + "\n";
  return lines;
}

std::string Script::send(std::string text) {
  link.send(std::move(text));
  return take();
}

void Script::expect(std::uint32_t channel) {
  user_->expect({channel});
}

void Script::forget(std::uint32_t channel) {
  user_->forget({channel});
}

void Script::expect_one(std::uint32_t channel) {
  user_->expect_one({channel});
}

void Script::reads_texts(bool may) {
  user_->reads_texts = may;
}

void Script::let_go(std::uint32_t channel) {
  user_->let_go({channel});
}

std::string Script::packet_in(bool text, const Bytes& packet) {
  link.on_packet(text, Payload::copy_of(packet), now_ms(at));
  return take();
}

std::string Script::take() {
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

Script await_login() {
  Script script(true);
  EXPECT_EQ(script.binary(hello()), "-");
  return script;
}
Script authenticating() {
  auto script = await_login();
  EXPECT_EQ(script.binary(login()), "ask token");
  return script;
}
Script open_server() {
  auto script = authenticating();
  EXPECT_EQ(script.authenticated(), "open");
  EXPECT_TRUE(script.link.next_packet(now_ms(0)));  // welcome
  return script;
}
Script open_client() {
  Script script(false);
  EXPECT_TRUE(script.link.next_packet(now_ms(0)));  // hello
  EXPECT_TRUE(script.link.next_packet(now_ms(0)));  // login
  EXPECT_EQ(script.binary(encode(a_welcome())), "open");
  return script;
}

}  // namespace connect_bridge::link_test
