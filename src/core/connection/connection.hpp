// One connection to a peer, from the first byte to the last: hello, login, open, closed. The link
// that it carries handles the messages.
// One unit: the state decides about each input, each deadline and each packet.
#pragma once

#include <algorithm>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "core/connection/acknowledger.hpp"
#include "core/connection/channel.hpp"
#include "core/connection/clock_estimate.hpp"
#include "core/flow/outbox.hpp"
#include "core/flow/reassembly.hpp"
#include "core/policy/policy.hpp"
#include "core/wire/control.hpp"
#include "core/wire/login.hpp"

namespace connect_bridge {

struct ConnectionOptions {
  bool server = false;
  Token128 side;     // our own id
  Token128 session;  // client: the session to continue, or zero
  std::string node;
  Stamp expires = 0;                     // server: when the peer's certificate expires; 0: never
  Identity server_is;                    // client
  std::string login_method;              // client
  Bytes credential;                      // client
  Duration login_timeout{};              // until the login is answered
  std::optional<Duration> login_within;  // server: the peer must send its login sooner than that
  Duration dead_after{};
  Duration time_period{};  // see LinkOptions
  OutboxOptions outbox;
  ReassemblyOptions reassembly;
};

// The peer. Valid once the connection is open.
struct Peer {
  std::string address;
  Stamp expires = 0;  // of its certificate
  Token128 side;
  Token128 session;
  std::string node;
  Identity identity;
  std::uint32_t message_bytes_max = 0;
};

// Receives each arrival on an open connection, once and immediately. An error closes the connection
// with its code.
class ConnectionUser {
 public:
  // The channel of a message; called before a byte of the message is kept. Null: the peer may not
  // send on it. Valid until the channel gets the message, which may end the channel.
  [[nodiscard]] virtual Incoming* incoming(ChannelId channel) = 0;
  virtual Result<Nothing> on_control(Control& control, const Now& now) = 0;
  // May so many bytes of control texts be decompressed now? If so, they are counted.
  [[nodiscard]] virtual bool may_read_texts(std::uint32_t raw_bytes, const Now& now) = 0;
  // The peer has received all of a tracked message.
  virtual void on_delivered(const Outbox::Delivered& whole, const Now& now) = 0;
  // A sample of the peer's clocks has arrived now, and clock() includes it.
  virtual void on_peer_time(const TimeReply& reply, const Now& now) = 0;

 protected:
  ~ConnectionUser() = default;
};

// The legal packets of each state (docs/protocol.md section "States"):
//
//   state            text      binary
//   kAwaitHello      illegal   hello
//   kAwaitLogin      illegal   login
//   kAuthenticating  illegal   illegal
//   kAwaitWelcome    illegal   welcome
//   kOpen            control   packet of frames
//   kClosed          ignored   ignored
//
// After an error failure() returns it. From then on the connection is kClosed and does nothing, and
// its owner closes the WebSocket with that code. Not thread-safe.
class Connection {
 public:
  enum class State { kAwaitHello, kAwaitLogin, kAuthenticating, kAwaitWelcome, kOpen, kClosed };

  Connection(ConnectionOptions options, ConnectionId id, std::string address, const Now& now);

  void on_packet(bool text, const Payload& packet, const Now& now);
  // Server: the login of the peer, once. The answer is on_authenticated() or fail().
  std::optional<Login> take_login() { return std::exchange(login_, std::nullopt); }
  // Server: the login is right. `session` names the link that is opened or continued.
  void on_authenticated(const Identity& identity, Token128 session, const Now& now);
  // Gives an open connection its user; called before the next input. `memory`: the budget for all
  // that the connection holds; it must outlive the connection. Null: only the connection's own
  // limits.
  void carry(ConnectionUser& user, Budget* memory = nullptr) {
    user_ = &user;
    if (!memory) return;
    outbox_.draw_from(*memory);
    texts_held_ = memory->hold(0);
    reassembly_.draw_from(*memory);
  }
  // A packet has come that on_packet() will get later. Until then the peer is not silent.
  void has_come() { unread_ = true; }
  void on_time(const Now& now);
  // The network has changed. A peer that can still be reached is heard within a third of
  // dead_after, or a second if that is longer.
  void probe(const Now& now);
  void close() { state_ = State::kClosed; }
  void fail(CloseCode code, std::string reason);
  [[nodiscard]] const std::optional<Error>& failure() const { return failure_; }

  void send(const Control& message);
  // An encoded control message. `completes`: the first round of offers ends with it.
  void send(std::string text, bool completes = false);
  // Texts of an earlier connection that the peer may refer to once, after `accepts` has named them.
  void name_texts(Bytes kept);
  // The texts of the peer.
  [[nodiscard]] const TextHistory& texts() const { return texts_; }
  // OutboxOptions and ReassemblyOptions bound the buffers of both directions.
  Outbox& outbox() { return outbox_; }
  [[nodiscard]] const Outbox& outbox() const { return outbox_; }
  // Sets the period of requests for the peer's clock; the default is dead_after / 3.
  void set_time_period(Duration period, const Now& now) {
    time_period_ = period;
    next_time_request_ = std::min(next_time_request_, now.steady + period);
  }

  std::optional<Packet> next_packet(const Now& now, const Repairs& repairs = {});
  // False: next_packet() need not be called.
  [[nodiscard]] bool may_have_packet() const {
    return !records_.empty() || (open() && outbox_.may_have_packet());
  }
  // The result of next_packet() would not be urgent.
  [[nodiscard]] bool may_wait() const { return records_.empty() && open() && outbox_.may_wait(); }
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] bool open() const { return state_ == State::kOpen; }
  [[nodiscard]] ConnectionId id() const { return id_; }
  [[nodiscard]] const Peer& peer() const { return peer_; }
  // The peer has sent its limit after the login.
  void set_peer_message_bytes_max(std::uint32_t bytes) { peer_.message_bytes_max = bytes; }
  [[nodiscard]] const ClockEstimate& clock() const { return clock_; }
  // The time at which a silent peer counts as gone.
  [[nodiscard]] TimePoint dead_at() const { return last_heard_ + options_.dead_after; }
  [[nodiscard]] Duration unheard(const Now& now) const { return now.steady - last_heard_; }
  [[nodiscard]] std::uint64_t received_bytes() const { return acknowledger_.received_bytes(); }
  [[nodiscard]] std::uint64_t sent_bytes() const { return sent_bytes_; }
  [[nodiscard]] std::uint64_t open_bytes() const { return reassembly_.open_bytes(); }

 private:
  void on_record(ByteView record, const Now& now);
  void on_welcome(ByteView record, const Now& now);
  Result<Nothing> on_control(std::string_view text, const Now& now);
  void push(Outbox::ControlText text);
  void keep_texts();
  void hold_texts() { texts_held_.resize(texts_.size() + named_texts_.size()); }
  Result<Nothing> on_texts(const TextsFrame& frame, const Now& now);
  Result<Nothing> on_frames(const Payload& packet, const Now& now);
  // True: the frame carried data, so that an acknowledgement is due.
  Result<bool> on_frame(const Frame& frame, const Payload& packet, const Now& now);
  // Gives a complete message to the channel, which may end then. Null: the message is dropped.
  Result<bool> on_data(IncomingChannel* channel, Result<std::optional<InMessage>> whole,
                       const Now& now);
  void opened(const Now& now);
  [[nodiscard]] TimePoint silent_at() const;

  ConnectionOptions options_;
  ConnectionId id_;
  State state_;
  std::optional<Login> login_;  // server: received and not yet taken
  std::optional<Error> failure_;
  ConnectionUser* user_ = nullptr;  // null until the connection carries a link
  Peer peer_;
  TimePoint login_answered_by_;
  TimePoint login_deadline_;
  TimePoint last_heard_;
  bool unread_ = false;  // a packet has come
  std::optional<TimePoint> probe_ends_at_;
  TimePoint next_time_request_{};
  Duration time_period_;
  std::deque<Stamp> time_asked_;  // t1 of the requests without a reply
  int quick_time_requests_ = 5;   // the first requests follow each other quickly
  std::deque<Payload> records_;   // login records waiting to be sent
  std::uint64_t sent_bytes_ = 0;
  TextHistory texts_;
  Bytes named_texts_;
  Budget::Hold texts_held_;
  Outbox outbox_;
  Reassembly reassembly_;
  Acknowledger acknowledger_;
  ClockEstimate clock_;
};

}  // namespace connect_bridge
