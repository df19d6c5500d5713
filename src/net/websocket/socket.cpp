#include "net/websocket/socket.hpp"

#include <algorithm>
#include <span>

#include "net/tcp/route_watch.hpp"
#include "net/tcp/socket_tuning.hpp"
#include "net/tcp/steady_now.hpp"
#include "net/tls/certified.hpp"
#include "net/tls/tls.hpp"
#include "net/websocket/websocket.hpp"

namespace connect_bridge {
namespace {

constexpr std::chrono::milliseconds kCloseTime{1000};
constexpr std::size_t kCloseReasonBytesMax = 120;

// Packets of many small pieces are copied together: a piece costs more in the layers below than
// its bytes do, and the kernel takes 64 at a time (IOV handling of Asio).
constexpr std::size_t kFlatBytesMax = 16384;
constexpr std::size_t kPiecesMax = 32;

// At most `limit` bytes, not ending inside a UTF-8 character.
std::string cut(const std::string& text, std::size_t limit) {
  if (text.size() <= limit) return text;
  std::size_t end = limit;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return text.substr(0, end);
}

}  // namespace

Socket::Socket(SocketSetup setup)
    : setup_(std::move(setup)),
      socket_(std::move(setup_.socket)),
      deadline_(socket_->get_executor()),
      packet_rate_(setup_.options.receive_packets_per_second, setup_.options.receive_burst),
      read_at_(socket_->get_executor()),
      gate_(socket_->next_layer().read_bytes()),
      extra_frames_(socket_->next_layer().read_bytes()),
      unsent_max_(setup_.options.unsent_bytes_max),
      traffic_(header_bytes_of(native())) {
  socket_->auto_fragment(false);
  socket_->write_buffer_bytes(std::max<std::size_t>(setup_.options.write_buffer_bytes, 64));
  socket_->read_message_max(Gate::kPacketBytesMax);
  socket_->next_layer().limit_reads([this] { return frames_due(); });
  // Beast answers the peer's close frame by itself: that, too, must end in time.
  socket_->control_callback([this](websocket::frame_type kind, beast::string_view) {
    if (kind == websocket::frame_type::close) set_deadline();
  });
}

void Socket::open() {
  setup_.events->input(ConnectionOpened(setup_.opened));
  if (state_ != State::kOpen) return;
  read();
}

void Socket::go_on() {
  if (std::exchange(waits_, false) && state_ == State::kOpen) read_on();
}

void Socket::allow(std::size_t packet_bytes_max) {
  gate_.open();
  socket_->next_layer().read_ahead();
  setup_.pending_slot.reset();
  socket_->read_message_max(packet_bytes_max);
}

// ---- reading

void Socket::read() {
  if (reading_ || held_ || state_ != State::kOpen) return;
  reading_ = true;
  socket_->async_read(received_, [self = shared_from_this()](ErrorCode error, std::size_t) {
    self->reading_ = false;
    self->on_read(error);
  });
}

void Socket::on_read(const ErrorCode& error) {
  if (state_ != State::kOpen) return;
  if (error) return fail(error);
  if (!within_gate()) return end_flood();  // mutant: gate_messages
  received_bytes_ += received_.size();
  ++messages_;
  if (repair_watch_.misses()) repair_watch_.has_read(tcp_counts_of(native()));
  packet_rate_.take(1, steady_now());
  waits_ = true;
  setup_.events->arrived({setup_.opened.connection, socket_->got_text(), received_.take()});
}

// A frame that is no message costs as much as one.
std::optional<std::chrono::steady_clock::time_point> Socket::frames_due() {
  if (!within_gate())  // not here: a read is about to begin
    asio::post(socket_->get_executor(), [self = shared_from_this()] { self->end_flood(); });
  const std::uint64_t extra = extra_frames_.count(socket_->next_layer().read_bytes(),
                                                  received_bytes_ + received_.size(), messages_);
  const TimePoint now = steady_now();
  if (extra > 0) packet_rate_.take(static_cast<double>(extra), now);
  const TimePoint at = packet_rate_.ready_at();
  if (extra == 0 || state_ != State::kOpen || at <= now) return std::nullopt;
  if (setup_.held) setup_.held(setup_.opened.peer);
  return std::chrono::steady_clock::time_point(at.time_since_epoch());
}

void Socket::read_on() {
  const TimePoint at = packet_rate_.ready_at();
  if (at <= steady_now()) return read();
  held_ = true;
  if (setup_.held) setup_.held(setup_.opened.peer);
  read_at_.expires_at(std::chrono::steady_clock::time_point(at.time_since_epoch()));
  read_at_.async_wait([self = shared_from_this()](ErrorCode) {
    self->held_ = false;
    self->read();
  });
}

bool Socket::within_gate() {
  return gate_.admits(socket_->next_layer().read_bytes(), state_ != State::kOpen);
}

void Socket::end_flood() {
  const char* const why = "too much before the login";
  if (state_ != State::kOpen) return drop({Cause::kTooLarge, why});
  close(static_cast<std::uint16_t>(CloseCode::kTooLarge), why);
}

// ---- writing

void Socket::send() {
  pull_again_ = true;
  if (writing_ || waiting_for_room_ || state_ != State::kOpen) return;
  if (!has_room()) return wait_for_room();
  ask_tcp(steady_now());
  packet_ = setup_.events->next_packet(setup_.opened.connection, repair_watch_.repairs());
  if (!packet_ || state_ != State::kOpen) return;
  pull_again_ = packet_->more;
  writing_ = true;
  limit_unsent(packet_->unsent_bytes_max);
  gather(*packet_);
  socket_->text(packet_->text);
  socket_->async_write(std::span<const asio::const_buffer>{pieces_},
                       [self = shared_from_this()](ErrorCode error, std::size_t) {
                         self->writing_ = false;
                         self->on_written(error);
                       });
}

int Socket::native() {
  return socket_->next_layer().socket().native_handle();
}

void Socket::ask_tcp(TimePoint now) {
  const bool chooses =
      setup_.options.congestion_control == "auto" && congestion_choice_.is_due(now);
  if (!chooses && !repair_watch_.is_due(now)) return;
  const TcpCounts counts = tcp_counts_of(native());
  repair_watch_.note(counts, now);
  if (!chooses) return;
  if (const auto changed = congestion_choice_.next(counts, now))
    set_congestion_control(native(), *changed);
}

// The next packet is chosen as late as possible: only when the kernel has little left to send. The
// kernel is asked only when the bytes written since the last question could fill that; waiting for
// writability would cost two system calls per packet.
bool Socket::has_room() {
  if (unsent_max_ == 0 || unsent_bound_ < unsent_max_) return true;
  unsent_bound_ = unsent_bytes(native());
  return unsent_bound_ < unsent_max_;
}

// Data that the kernel holds back (for example after a loss) delays an urgent message: on a slow
// link less may wait there. A small change is not worth a system call.
void Socket::limit_unsent(std::uint32_t bytes) {
  if (unsent_max_ == 0 || bytes == 0) return;
  const std::uint32_t wanted = std::min(bytes, setup_.options.unsent_bytes_max);
  if (wanted <= unsent_max_ && wanted >= unsent_max_ - unsent_max_ / 4) return;
  unsent_max_ = wanted;
  set_unsent_bytes_max(native(), wanted);
}

void Socket::wait_for_room() {
  waiting_for_room_ = true;
  socket_->next_layer().socket().async_wait(TcpSocket::wait_write,
                                            [self = shared_from_this()](ErrorCode error) {
                                              self->waiting_for_room_ = false;
                                              // Errors are reported by the read that is under way.
                                              if (!error) self->send();
                                            });
}

void Socket::gather(const Packet& packet) {
  pieces_.clear();
  const std::size_t bytes = packet.size();
  unsent_bound_ += bytes;
  if (packet.pieces.size() > kPiecesMax || (packet.pieces.size() > 1 && bytes <= kFlatBytesMax)) {
    flat_.clear();
    for (const Payload& piece : packet.pieces) {
      flat_.insert(flat_.end(), piece.view().begin(), piece.view().end());
    }
    pieces_.emplace_back(flat_.data(), flat_.size());
    return;
  }
  for (const Payload& piece : packet.pieces) {
    pieces_.emplace_back(piece.view().data(), piece.size());
  }
  if (pieces_.empty()) pieces_.emplace_back();
}

void Socket::on_written(const ErrorCode& error) {
  packet_.reset();
  if (state_ != State::kOpen) return;
  // Beast reports the cause to one operation only: the read, which is about to return it. A packet
  // that waits for its turn is handled first.
  if (error && (waits_ || (error == asio::error::operation_aborted && reading_)))
    return set_deadline();
  if (error) return fail(error);
  if (pull_again_) send();
}

// ---- ending

void Socket::close(std::uint16_t code, const std::string& reason) {
  if (state_ != State::kOpen) return;
  state_ = State::kClosing;
  set_deadline();
  closing_ = {cause_of(static_cast<CloseCode>(code)), "closed by us: " + reason};
  const std::string text = cut(reason, kCloseReasonBytesMax);
  const websocket::close_reason why{static_cast<websocket::close_code>(code),
                                    beast::string_view{text.data(), text.size()}};
  // Beast sends the close frame after the packet that is being written.
  socket_->async_close(why, [self = shared_from_this()](ErrorCode error) {
    const auto& peer = self->socket_->reason();
    const bool answered = !error && peer.code != websocket::close_code::none;
    self->end(answered ? std::optional<std::uint16_t>{peer.code} : std::nullopt, self->closing_,
              !error);
  });
}

void Socket::fail(const ErrorCode& error) {
  if (error == websocket::error::closed) {
    const auto& peer = socket_->reason();
    std::optional<std::uint16_t> code;
    if (peer.code != websocket::close_code::none) code = peer.code;
    const std::string reason{peer.reason.data(), peer.reason.size()};
    return end(code, {Cause::kClosed, reason.empty() ? "closed by the other end" : reason}, true);
  }
  if (error == websocket::error::message_too_big) {
    return end(
        std::nullopt,
        {Cause::kTooLarge, gate_.is_open() ? "the other end sent a packet beyond the limit"
                                           : "the other end sent a packet too large for a login"},
        true);
  }
  // Beast has sent the close frame of a protocol error itself.
  const bool protocol = error.category() == make_error_code(websocket::error::closed).category();
  Failure why = failure_of(error, socket_->next_layer().tls(), {});
  if (protocol) why.cause = Cause::kMalformed;
  end(std::nullopt, std::move(why), protocol);
}

void Socket::end(std::optional<std::uint16_t> code, Failure why, bool orderly) {
  if (state_ == State::kEnding) return;
  static_cast<void>(traffic());
  state_ = State::kEnding;
  set_deadline();
  const auto self = shared_from_this();
  Transport& transport = socket_->next_layer();
  if (orderly) {
    transport.finish([self] { self->forget(); });
  } else {
    transport.abort();  // an operation may still be under way on it
    asio::post(socket_->get_executor(), [self] { self->forget(); });
  }
  setup_.events->input(
      ConnectionClosed{setup_.opened.connection, code, std::move(why.text), why.cause});
}

void Socket::set_deadline() {
  if (deadline_set_) return;
  deadline_set_ = true;
  call_after(deadline_, kCloseTime, if_alive(this, &Socket::on_deadline));
}

void Socket::on_deadline() {
  cut_off();
  const bool ours = state_ == State::kClosing;
  const Failure theirs{Cause::kConnectionLost, "the other end did not complete its close"};
  end(std::nullopt, ours ? closing_ : theirs, false);
  forget();
}

void Socket::cut_off() {
  static_cast<void>(traffic());
  socket_->next_layer().abort();
}

void Socket::abandon() {
  state_ = State::kEnding;
  forgotten_ = true;
  setup_.connection_slot.reset();
  setup_.pending_slot.reset();
  deadline_.cancel();
  read_at_.cancel();
  socket_->next_layer().abort();
}

void Socket::forget() {
  if (forgotten_) return;
  forgotten_ = true;
  setup_.connection_slot.reset();
  setup_.pending_slot.reset();
  deadline_.cancel();
  read_at_.cancel();
  setup_.gone(setup_.opened.connection);
}

void Socket::give_way() {
  const auto self = shared_from_this();
  setup_.connection_slot.reset();
  setup_.pending_slot.reset();
  drop({Cause::kTooManyConnections, "closed for a newer connection without a login"});
}

void Socket::drop(const Failure& why) {
  cut_off();
  end(std::nullopt, why, false);
}

void Socket::check_address() {
  if (state_ != State::kOpen) return;
  const std::string address = lost_address(socket_->next_layer().socket());
  if (!address.empty())
    end(std::nullopt, {Cause::kAddressGone, "the address " + address + " of this machine is gone"},
        false);
}

void Socket::follow_path() {
  if (state_ != State::kOpen) return;
  limit_retry(native());
}

Certified Socket::certified() const {
  return certified_by(socket_->next_layer().tls());
}

std::string Socket::login_word() const {
  return connect_bridge::login_word(socket_->next_layer().tls());
}

Traffic Socket::traffic() {
  if (state_ != State::kEnding) traffic_.count(tcp_counts_of(native()));
  return traffic_.total();
}

}  // namespace connect_bridge
