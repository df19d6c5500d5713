// Where the status of a side is asked for: HTTP, GET only, one answer for each connection.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>

#include "core/base/address_paces.hpp"
#include "core/base/pace.hpp"
#include "core/ports/net_options.hpp"
#include "core/ports/ports.hpp"
#include "net/tcp/tcp_doors.hpp"
#include "net/tcp/transport.hpp"
#include "net/tls/tls_files.hpp"

namespace connect_bridge {

struct StatusRequest {
  std::string path;           // without what follows a '?'
  bool open_metrics = false;  // OpenMetrics is understood, not only the older text of Prometheus
  bool sees_names = false;    // who asks may know who is on the links
};

// One text that all its receivers share, also those that take it slowly.
using SharedText = std::shared_ptr<const std::string>;

struct StatusAnswer {
  unsigned status = 200;  // of HTTP
  std::string type = "text/plain; charset=utf-8";
  SharedText body{};          // not null
  std::string page_policy{};  // what a page may do (CSP); empty: nothing
  bool streams = false;       // events follow: what tell() is given
};

// A line of text.
[[nodiscard]] StatusAnswer plain_answer(unsigned status, const std::string& text);
// Metrics, in the format that the request understands.
[[nodiscard]] StatusAnswer metrics_answer(const StatusRequest& request, SharedText metrics);

// Answers HTTP requests for the status. A visitor is a stranger until its request was read, and its
// token if it needs one. There are limits for the connections of strangers, their time, the header,
// and TLS handshakes. Where all places are taken the newest visitor gets that of another one, who
// has not asked or had most time to read. Visitors by the socket file have places of their own.
// Thread: that of the io_context, which is not the loop's.
class StatusDoor : public std::enable_shared_from_this<StatusDoor> {
 public:
  // By TCP, and as many by the file.
  static constexpr std::size_t kConnectionsMax = 32;
  static constexpr std::size_t kStreamsMax = 8;  // of these; so there is room for others
  static constexpr std::uint32_t kHeaderBytesMax = 8192;
  static constexpr std::size_t kStreamBytesPerSecond =
      50'000;  // larger events come less often, at least every 5 s

  using Answered = std::function<void(StatusAnswer)>;
  struct Ports {
    // `answered` is called once, now or later, in the same thread.
    std::function<void(const StatusRequest&, Answered answered)> answer;
    // Whether the owner of this token may look: 200, 401 or 403. Only where `tls` is given.
    std::function<unsigned(const std::string& token)> judge;
    std::function<void(LogLevel, std::string)> log;
  };
  struct Times {
    std::chrono::milliseconds request{5000};  // accepted to header read
    std::chrono::milliseconds answer{10'000};
  };

  StatusDoor(asio::io_context& io, Ports ports, Times times);
  StatusDoor(asio::io_context& io, Ports ports) : StatusDoor(io, std::move(ports), Times{}) {}
  ~StatusDoor();

  // Each returns what is wrong, or nothing. With `tls` everybody needs a token.
  [[nodiscard]] std::string listen(const std::string& address, std::uint16_t port,
                                   const std::optional<TlsOptions>& tls);
  // A socket that only this process's user may use; it is removed at the end.
  [[nodiscard]] std::string listen_at_file(const std::string& file);
  // Where it listens by TCP; 0: nowhere.
  [[nodiscard]] std::uint16_t port() const;

  // An event for those who follow the stream and still may: one text for who sees names, one for
  // others.
  void tell(const SharedText& with_names, const SharedText& without);
  [[nodiscard]] std::size_t streams() const;  // how many follow, or are about to
  // Reads certificates that have changed. Once a second.
  void check_files();
  void close();

 private:
  class Session;
  using Sessions = std::list<std::shared_ptr<Session>>;

  [[nodiscard]] TcpDoors::Events admits(bool is_private);
  [[nodiscard]] std::size_t streams(bool is_private) const;
  void admit(TcpSocket socket, bool is_private);
  void remove(const std::shared_ptr<Session>& session);

  asio::io_context& io_;
  const Ports ports_;
  const Times times_;
  std::shared_ptr<TcpDoors> doors_;      // null: nowhere by TCP
  std::shared_ptr<TcpDoors> file_door_;  // null: at no file
  std::string file_;
  std::optional<TlsFiles> tls_;
  AddressPaces paces_{20, std::chrono::milliseconds(500)};  // of TLS handshakes, by address
  Pace pace_{50, std::chrono::milliseconds(50)};            // of all of them
  Sessions sessions_;                                       // the oldest first
  std::uint64_t answers_ = 0;
};

}  // namespace connect_bridge
