// One connection to a peer, from the first byte to the last: hello, login, open, closed. What the
// messages mean for exports and imports is the side's business.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <unordered_set>
#include <variant>
#include <vector>

#include "core/flow/outbox.hpp"
#include "core/flow/reassembly.hpp"
#include "core/link/acknowledger.hpp"
#include "core/link/clock_estimate.hpp"
#include "core/policy/policy.hpp"
#include "core/wire/control.hpp"
#include "core/wire/login.hpp"

namespace connect_bridge {

struct ConnectionOptions {
  bool server = false;
  Token128 side;     // our own id
  Token128 session;  // client: the session to continue, or zero
  std::string node;
  std::string login_method;  // client
  Bytes credential;          // client
  Duration login_timeout{};
  Duration dead_after{};
  OutboxOptions outbox;
  ReassemblyOptions reassembly;
};

// Who is at the other end. Valid once the link is open (the identity: at a server only).
struct Peer {
  std::string address;
  Token128 side;
  Token128 session;
  std::string node;
  Identity identity;
  std::uint32_t message_bytes_max = 0;
};

// What a link tells the side.
struct LoginAsked {  // server: answer with Link::on_authenticated
  std::string method;
  Bytes credential;
};
struct LoggedIn {};        // welcome sent (server) or received (client)
struct ConnectionFailed {  // the connection must be closed with this code
  CloseCode code = CloseCode::kMalformed;
  std::string reason;
};
struct PeerRosTime {  // the peer's ROS time, sampled; for clock publication
  TimeReply reply;
  Stamp t4 = 0;
};
struct Delivered {  // the peer has all of a tracked message
  ChannelId channel;
  OriginId origin;
};
using ConnectionEvent = std::variant<LoginAsked, LoggedIn, ConnectionFailed, PeerRosTime, Control,
                                     InMessage, Delivered>;
using ConnectionEvents = std::vector<ConnectionEvent>;

// Which packet is legal in which state is the table of docs/protocol.md section "States":
//
//   state            text      binary
//   kAwaitHello      illegal   hello
//   kAwaitLogin      illegal   login
//   kAuthenticating  illegal   illegal
//   kAwaitWelcome    illegal   welcome
//   kOpen            control   packet of frames
//   kClosed          ignored   ignored
//
// After ConnectionFailed the link is kClosed. Not thread-safe. Every call may append to `events`.
class Connection {
 public:
  enum class State { kAwaitHello, kAwaitLogin, kAuthenticating, kAwaitWelcome, kOpen, kClosed };

  Connection(ConnectionOptions options, ConnectionId id, std::string address, const Now& now);

  void on_packet(bool text, const Payload& packet, const Now& now, ConnectionEvents& events);
  // Server: the answer to LoginAsked. `session` names the link that is opened or continued.
  void on_authenticated(const Identity& identity, Token128 session, const Now& now,
                        ConnectionEvents& events);
  void on_time(const Now& now, ConnectionEvents& events);
  void close() { state_ = State::kClosed; }

  void send(const Control& message, ConnectionEvents& events);
  void send(std::string text, ConnectionEvents& events);  // an encoded control message
  // A bound on the sum of both directions' buffers lives in OutboxOptions and ReassemblyOptions.
  Outbox& outbox() { return outbox_; }
  [[nodiscard]] const Outbox& outbox() const { return outbox_; }
  // The channels the peer may send on: messages for others end the link before anything is kept.
  [[nodiscard]] bool is_expected(ChannelId channel) const { return incoming_.contains(channel); }
  [[nodiscard]] std::size_t incoming_channels() const { return incoming_.size(); }
  void expect_incoming(ChannelId channel) { incoming_.insert(channel); }
  void forget_incoming(ChannelId channel) {
    incoming_.erase(channel);
    reassembly_.forget(channel);
  }
  // How often the peer's clock is asked; the default is dead_after / 3.
  void set_time_period(Duration period) { time_period_ = period; }

  std::optional<Packet> next_packet(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] bool open() const { return state_ == State::kOpen; }
  [[nodiscard]] ConnectionId id() const { return id_; }
  [[nodiscard]] const Peer& peer() const { return peer_; }
  // The peer told its limit after the login.
  void set_peer_message_bytes_max(std::uint32_t bytes) { peer_.message_bytes_max = bytes; }
  [[nodiscard]] const ClockEstimate& clock() const { return clock_; }
  [[nodiscard]] TimePoint last_heard() const { return last_heard_; }
  [[nodiscard]] std::uint64_t received_bytes() const { return acknowledger_.received_bytes(); }
  [[nodiscard]] std::uint64_t sent_bytes() const { return sent_bytes_; }
  [[nodiscard]] std::uint64_t open_bytes() const { return reassembly_.open_bytes(); }

 private:
  void on_record(ByteView record, const Now& now, ConnectionEvents& events);
  void on_welcome(ByteView record, const Now& now, ConnectionEvents& events);
  void on_control(ByteView text, ConnectionEvents& events);
  void on_frames(const Payload& packet, const Now& now, ConnectionEvents& events);
  // Whether the frame carried data (so that an acknowledgement is due).
  Result<bool> on_frame(const Frame& frame, const Payload& packet, const Now& now,
                        ConnectionEvents& events);
  void opened(const Now& now, ConnectionEvents& events);
  void fail(CloseCode code, std::string reason, ConnectionEvents& events);

  ConnectionOptions options_;
  ConnectionId id_;
  State state_;
  Peer peer_;
  TimePoint login_deadline_;
  TimePoint last_heard_;
  TimePoint next_time_request_{};
  Duration time_period_;
  std::deque<Stamp> time_asked_;  // t1 of the requests without an answer
  int quick_time_requests_ = 5;   // the first ones follow each other quickly
  std::deque<Payload> records_;   // login records waiting to be sent
  std::uint64_t sent_bytes_ = 0;
  Outbox outbox_;
  Reassembly reassembly_;
  std::unordered_set<ChannelId> incoming_;
  Acknowledger acknowledger_;
  ClockEstimate clock_;
};

}  // namespace connect_bridge
