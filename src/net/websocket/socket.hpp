// One open WebSocket: reads packets behind the gate, pulls and writes packets, closes. One unit:
// its reads, its writes and its end depend on one state.
#pragma once

#include <boost/asio/buffer.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/flow/rate_limit.hpp"
#include "core/ports/net_options.hpp"
#include "net/tcp/admission.hpp"
#include "net/tcp/congestion_choice.hpp"
#include "net/tcp/repair_watch.hpp"
#include "net/tcp/traffic.hpp"
#include "net/websocket/extra_frames.hpp"
#include "net/websocket/gate.hpp"
#include "net/websocket/network_events.hpp"
#include "net/websocket/receive_buffer.hpp"

namespace connect_bridge {

struct Certified;  // net/tls/certified.hpp
struct WebSocket;

struct SocketSetup {
  ConnectionOpened opened;                 // what the loop gets
  std::shared_ptr<WebSocket> socket;       // after its handshake
  NetworkEvents* events = nullptr;         // lives until abandon() or the end of this object
  std::function<void(ConnectionId)> gone;  // the socket is closed; forget this object
  std::function<void(const std::string& peer)> held;  // it sends more than is read of it
  SocketOptions options;
  std::shared_ptr<Admission::Pending> pending_slot;  // given back by allow()
  std::shared_ptr<void> connection_slot;  // given back when the TCP connection is gone, before
                                          // `pending_slot`, if it has that still
};

// kOpen -> kClosing (our close frame is on its way) -> kEnding (ConnectionClosed delivered, TCP is
// brought down) -> gone; the peer's close or an error leads from kOpen to kEnding.
class Socket : public std::enable_shared_from_this<Socket> {
 public:
  explicit Socket(SocketSetup setup);
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  void open();  // delivers ConnectionOpened, then reads
  // The packet that was read has been handled: the socket reads on.
  void go_on();
  // There may be something to send.
  void send();
  void allow(std::size_t packet_bytes_max);
  void close(std::uint16_t code, const std::string& reason);
  // Closes at once and delivers nothing more.
  void abandon();
  // Closes at once and gives its places back, to make room for another connection.
  void give_way();
  // Closes it if the machine has lost the address that it is bound to: nothing can arrive any more.
  void check_address();

  // Gives TCP what suits the path. Once a second.
  void follow_path();

  [[nodiscard]] bool is_open() const { return state_ == State::kOpen; }
  // ConnectionClosed was delivered.
  [[nodiscard]] bool has_ended() const { return state_ == State::kEnding; }
  // Only while it is open.
  [[nodiscard]] TcpCounts tcp_counts() { return tcp_counts_of(native()); }
  // Until now, or until its end.
  [[nodiscard]] Traffic traffic();
  [[nodiscard]] std::uint64_t extra_frames() const { return extra_frames_.total(); }
  [[nodiscard]] Certified certified() const;
  [[nodiscard]] const std::string& address() const { return setup_.opened.address; }
  [[nodiscard]] const std::string& peer() const { return setup_.opened.peer; }
  // Only while it is open; empty: without TLS.
  [[nodiscard]] std::string login_word() const;

 private:
  enum class State : std::uint8_t { kOpen, kClosing, kEnding };

  void read();
  void on_read(const boost::system::error_code& error);
  // To be asked at each read and message: whether the peer has not sent too much before its login.
  bool within_gate();
  void end_flood();
  // Until when reading must wait for frames that are no messages.
  std::optional<std::chrono::steady_clock::time_point> frames_due();
  [[nodiscard]] int native();
  // The socket reads the counts of TCP when they are due, and takes what suits the path.
  void ask_tcp(TimePoint now);
  // Reads on, at once or when the rates allow it.
  void read_on();
  bool has_room();
  void wait_for_room();
  void limit_unsent(std::uint32_t bytes);
  void gather(const Packet& packet);
  void on_written(const boost::system::error_code& error);
  void fail(const boost::system::error_code& error);
  void end(std::optional<std::uint16_t> code, Failure why, bool orderly);
  void set_deadline();
  void on_deadline();
  // Ends it at once, without a close frame.
  void drop(const Failure& why);
  // Aborts the transport; reads its traffic counts first, while the kernel still has them.
  void cut_off();
  void forget();

  SocketSetup setup_;
  std::shared_ptr<WebSocket> socket_;
  boost::asio::steady_timer deadline_;
  State state_ = State::kOpen;

  ReceiveBuffer received_;
  bool reading_ = false;
  bool held_ = false;   // reading pauses until read_at_: the peer sends too much
  bool waits_ = false;  // a packet that was read, until go_on()
  std::uint64_t received_bytes_ = 0;
  std::uint64_t messages_ = 0;
  Throttle packet_rate_;
  boost::asio::steady_timer read_at_;
  Gate gate_;
  ExtraFrames extra_frames_;

  bool writing_ = false;
  bool pull_again_ = false;  // when the packet is written: there was more, or something happened
  bool waiting_for_room_ = false;
  std::uint32_t unsent_max_;        // 0: what the kernel allows
  std::uint64_t unsent_bound_ = 0;  // the kernel holds at most this many unsent bytes
  std::optional<Packet> packet_;    // being written
  std::vector<boost::asio::const_buffer> pieces_;
  Bytes flat_;
  TrafficMeter traffic_;
  CongestionChoice congestion_choice_;
  RepairWatch repair_watch_;

  Failure closing_;  // by us
  bool deadline_set_ = false;
  bool forgotten_ = false;
};

}  // namespace connect_bridge
