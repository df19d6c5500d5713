#include "core/connection/connection.hpp"

#include <algorithm>
#include <utility>

#include "core/compress/compress.hpp"

namespace connect_bridge {
namespace {

// The largest message that every peer accepts unless it states another limit (docs/protocol.md).
constexpr std::uint32_t kMessageBytesUnknown = 64 << 20;
constexpr Duration kProbeTimeMin = std::chrono::seconds(1);
constexpr Duration kQuickTimePeriod = std::chrono::milliseconds(100);

std::string_view as_text(ByteView bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

Connection::Connection(ConnectionOptions options, ConnectionId id, std::string address,
                       const Now& now)
    : options_(std::move(options)),
      id_(id),
      state_(options_.server ? State::kAwaitHello : State::kAwaitWelcome),
      login_answered_by_(now.steady + options_.login_timeout),
      login_deadline_(now.steady + options_.login_within.value_or(options_.login_timeout)),
      last_heard_(now.steady),
      time_period_(options_.time_period > Duration::zero()
                       ? std::min(options_.time_period, options_.dead_after / 3)
                       : options_.dead_after / 3),
      outbox_(options_.outbox),
      reassembly_(options_.reassembly) {
  peer_.address = std::move(address);
  peer_.expires = options_.expires;
  if (options_.server) return;
  peer_.identity = options_.server_is;
  Hello hello;
  hello.side = options_.side;
  hello.session = options_.session;
  hello.node = options_.node;
  records_.push_back(Payload::adopt(encode(hello)));
  records_.push_back(Payload::adopt(encode(Login{options_.login_method, options_.credential})));
}

void Connection::on_packet(bool text, const Payload& packet, const Now& now) {
  outbox_.on_received(packet.size(), now);
  if (state_ == State::kClosed) return;
  last_heard_ = now.steady;
  unread_ = false;
  probe_ends_at_.reset();
  if (state_ != State::kOpen) {
    if (text) return fail(CloseCode::kIllegal, "text before login");
    return on_record(packet.view(), now);
  }
  const auto result = text ? on_control(as_text(packet.view()), now) : on_frames(packet, now);
  if (!result) fail(result.error().code, result.error().message);
}

void Connection::on_record(ByteView record, const Now& now) {
  switch (state_) {
    case State::kAwaitHello: {
      auto hello = decode_hello(record);
      if (!hello) return fail(hello.error().code, hello.error().message);
      const Hello& h = hello.value();
      if (h.side == options_.side) return fail(CloseCode::kSameSide, "the peer is this process");
      peer_.side = h.side;
      peer_.session = h.session;
      peer_.node = h.node;
      state_ = State::kAwaitLogin;
      return;
    }
    case State::kAwaitLogin: {
      auto login = decode_login(record);
      if (!login) return fail(login.error().code, login.error().message);
      state_ = State::kAuthenticating;
      login_deadline_ = login_answered_by_;  // only this side's login method takes time now
      login_ = std::move(login).value();
      return;
    }
    case State::kAwaitWelcome: return on_welcome(record, now);
    default: return fail(CloseCode::kIllegal, "data before the login was answered");
  }
}

void Connection::on_welcome(ByteView record, const Now& now) {
  auto welcome = decode_welcome(record);
  if (!welcome) return fail(welcome.error().code, welcome.error().message);
  const Welcome& w = welcome.value();
  if (w.side == options_.side) return fail(CloseCode::kSameSide, "the peer is this process");
  peer_.side = w.side;
  peer_.session = w.session;
  peer_.node = w.node;
  peer_.message_bytes_max = w.message_bytes_max > 0 ? w.message_bytes_max : kMessageBytesUnknown;
  opened(now);
}

void Connection::on_authenticated(const Identity& identity, Token128 session, const Now& now) {
  if (state_ != State::kAuthenticating) return;
  peer_.identity = identity;
  peer_.session = session;
  peer_.message_bytes_max = kMessageBytesUnknown;  // until its "accepts" gives a limit
  Welcome welcome;
  welcome.side = options_.side;
  welcome.session = session;
  welcome.dead_after_ms =
      static_cast<std::uint32_t>(options_.dead_after / std::chrono::milliseconds(1));
  welcome.message_bytes_max = options_.reassembly.message_bytes_max;
  welcome.node = options_.node;
  welcome.identity = identity.name;
  records_.push_back(Payload::adopt(encode(welcome)));
  opened(now);
}

void Connection::opened(const Now& now) {
  state_ = State::kOpen;
  last_heard_ = now.steady;  // a login may take longer than dead_after
  next_time_request_ = now.steady;
}

Result<Nothing> Connection::on_control(std::string_view text, const Now& now) {
  auto control = decode_control(text);
  if (!control) return control.error();
  if (const auto* offer = std::get_if<Offer>(&control.value()); offer && offer->complete)
    keep_texts();
  return user_->on_control(control.value(), now);
}

void Connection::keep_texts() {
  texts_.keep();
  hold_texts();
}

void Connection::name_texts(Bytes kept) {
  named_texts_ = std::move(kept);
  hold_texts();
}

// The whole frame belongs to the history before one of its texts counts, as at the sender.
Result<Nothing> Connection::on_texts(const TextsFrame& frame, const Now& now) {
  if (frame.kept && named_texts_.empty())
    return malformed("texts refer to those of an earlier connection, which were not named");
  if (!user_->may_read_texts(frame.raw_bytes, now))
    return Error{CloseCode::kTooLarge, "control texts come too fast"};
  if (frame.kept) texts_.go_on(std::exchange(named_texts_, {}));
  const auto raw = decompress_delta(frame.body, texts_.texts(), frame.raw_bytes);
  if (!raw) return raw.error();
  texts_.add(raw.value());
  hold_texts();
  std::string_view rest = as_text(raw.value());
  for (std::size_t count = 1;; ++count) {
    if (count > kTextsMax)
      return Error{CloseCode::kTooLarge, "more control texts in a frame than a side may send"};
    const auto end = rest.find('\n');
    if (auto done = on_control(rest.substr(0, end), now); !done) return done.error();
    if (state_ != State::kOpen || end == std::string_view::npos) return Nothing{};
    rest.remove_prefix(end + 1);
  }
}

// Frames take effect one after the other, until one is wrong. The packet is acknowledged as a whole
// and last, since the count includes it. A packet of acknowledgements and time frames alone makes
// none due by its age: two idle sides would acknowledge each other's acknowledgements for ever.
Result<Nothing> Connection::on_frames(const Payload& packet, const Now& now) {
  FrameReader reader(packet.view());
  Acknowledger::Contents contents;
  bool had_texts = false;
  for (std::uint32_t frames = 0;; ++frames) {
    auto next = reader.next();
    if (!next) return next.error();
    if (!next.value()) break;
    if (frames == kPacketFramesMax)  // mutant: frames_max
      return Error{CloseCode::kTooLarge, "more frames in a packet than a side may send"};
    if (std::holds_alternative<AckRequest>(*next.value())) {
      contents.asks = true;
      continue;
    }
    // Such a frame costs much more than any other.
    if (std::holds_alternative<TextsFrame>(*next.value()) && std::exchange(had_texts, true))
      return Error{CloseCode::kTooLarge, "more frames of texts in a packet than a side may send"};
    auto data = on_frame(*next.value(), packet, now);
    if (!data) return data.error();
    if (state_ != State::kOpen) return Nothing{};  // an earlier message has closed it
    contents.data = contents.data || data.value();
  }
  acknowledger_.on_packet(packet.size(), contents, now.steady);
  if (const auto ack = acknowledger_.take_due(now.steady)) outbox_.push_small(*ack);
  return Nothing{};
}

Result<bool> Connection::on_data(IncomingChannel* channel, Result<std::optional<InMessage>> whole,
                                 const Now& now) {
  if (!whole) return whole.error();
  if (!whole.value() || !channel) return true;
  auto result = channel->on_message(std::move(*std::move(whole).value()), now);
  if (!result) return result.error();
  return true;
}

Result<bool> Connection::on_frame(const Frame& frame, const Payload& packet, const Now& now) {
  const auto unknown = [] {
    return Error{CloseCode::kUnknownChannel, "data for a channel that does not exist"};
  };
  if (const auto* message = std::get_if<MessageFrame>(&frame)) {
    Incoming* const to = user_->incoming(message->channel);
    if (!to) return unknown();
    const bool keep = to->channel && to->channel->wants(message->demand);
    return on_data(to->channel, reassembly_.on_message(to->stream, *message, packet, keep), now);
  }
  if (const auto* part = std::get_if<PartFrame>(&frame)) {
    Incoming* const to = user_->incoming(part->channel);
    if (!to) return unknown();
    return on_data(to->channel, reassembly_.on_part(to->stream, *part), now);
  }
  if (const auto* texts = std::get_if<TextsFrame>(&frame)) {
    const auto done = on_texts(*texts, now);
    if (!done) return done.error();
    return true;
  }
  if (const auto* ack = std::get_if<AckFrame>(&frame)) {
    const auto delivered = outbox_.acknowledge({ack->received_bytes, ack->arrived}, now);
    if (!delivered) return Error{CloseCode::kIllegal, "acknowledged more bytes than were sent"};
    for (const auto& whole : *delivered) user_->on_delivered(whole, now);
    return false;
  }
  if (const auto* request = std::get_if<TimeRequest>(&frame)) {
    outbox_.push_small(TimeReply{request->t1, now.system, now.system, now.ros});
    return false;
  }
  const auto& reply = std::get<TimeReply>(frame);
  if (std::erase(time_asked_, reply.t1) == 0) return false;  // never requested, or too long ago
  clock_.add(reply, now.system);
  user_->on_peer_time(reply, now);
  return false;
}

void Connection::on_time(const Now& now) {
  if (state_ == State::kClosed) return;
  if (state_ != State::kOpen) {
    if (now.steady >= login_deadline_) fail(CloseCode::kLoginTimeout, "no complete login in time");
    return;
  }
  if (now.steady >= silent_at())  // mutant: silence
    return fail(CloseCode::kSilent, probe_ends_at_
                                        ? "nothing heard from the peer since the network changed"
                                        : "nothing heard from the peer");
  if (const auto ack = acknowledger_.take_due(now.steady)) outbox_.push_small(*ack);
  outbox_.on_time(now);
  if (now.steady >= next_time_request_) {
    outbox_.push_small(TimeRequest{now.system});
    if (time_asked_.size() == kTimeFramesMax) time_asked_.pop_front();
    time_asked_.push_back(now.system);
    const bool quick = quick_time_requests_ > 0;
    if (quick) --quick_time_requests_;
    next_time_request_ =
        now.steady + (quick ? std::min(kQuickTimePeriod, time_period_) : time_period_);
  }
}

void Connection::probe(const Now& now) {
  if (state_ != State::kOpen || probe_ends_at_) return;
  probe_ends_at_ = now.steady + std::max(options_.dead_after / 3, kProbeTimeMin);  // mutant: probe
  next_time_request_ = now.steady;
}

TimePoint Connection::silent_at() const {
  if (unread_) return TimePoint::max();
  return probe_ends_at_ ? std::min(dead_at(), *probe_ends_at_) : dead_at();
}

// A credential must not stay in the history of texts, nor in a copy of it.
void Connection::send(const Control& message) {
  const bool plain = std::holds_alternative<Renew>(message);
  for (auto& text : encode_parts(message)) push({std::move(text), false, plain});
}

void Connection::send(std::string text, bool completes) {
  push({std::move(text), completes});
}

void Connection::push(Outbox::ControlText text) {
  if (state_ != State::kOpen) return;
  if (!outbox_.push_control(std::move(text)))
    fail(CloseCode::kSlowPeer, "control messages back up");
}

std::optional<Packet> Connection::next_packet(const Now& now, const Repairs& repairs) {
  if (!records_.empty()) {
    Packet packet;
    packet.pieces.push_back(std::move(records_.front()));
    records_.pop_front();
    packet.more = may_have_packet();
    return packet;
  }
  if (state_ != State::kOpen) return std::nullopt;
  auto packet = outbox_.next(now, repairs);
  if (packet && !packet->text) sent_bytes_ += packet->size();
  return packet;
}

std::optional<TimePoint> Connection::deadline() const {
  if (state_ == State::kClosed) return std::nullopt;
  if (state_ != State::kOpen) return login_deadline_;
  TimePoint first = std::min(silent_at(), next_time_request_);
  if (auto ack = acknowledger_.deadline()) first = std::min(first, *ack);
  if (auto paced = outbox_.deadline()) first = std::min(first, *paced);
  return first;
}

void Connection::fail(CloseCode code, std::string reason) {
  if (state_ == State::kClosed) return;
  state_ = State::kClosed;
  failure_ = Error{code, std::move(reason)};
}

}  // namespace connect_bridge
