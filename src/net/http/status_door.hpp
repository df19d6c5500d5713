// The HTTP door to the status of a side: GET only, one answer for each connection.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>

#include "core/base/address_paces.hpp"
#include "core/base/log_limit.hpp"
#include "core/base/pace.hpp"
#include "core/ports/net_options.hpp"
#include "core/ports/ports.hpp"
#include "net/tcp/tcp_doors.hpp"
#include "net/tcp/transport.hpp"
#include "net/tls/tls_files.hpp"

namespace connect_bridge {

struct StatusRequest {
  std::string path;           // without the query behind '?'
  bool open_metrics = false;  // the reader understands OpenMetrics, not only Prometheus' older text
  bool sees_names = false;    // the reader may know who is on the links
};

// One text that all receivers share, also slow ones.
using SharedText = std::shared_ptr<const std::string>;

struct StatusAnswer {
  unsigned status = 200;  // of HTTP
  std::string type = "text/plain; charset=utf-8";
  SharedText body{};          // not null
  std::string page_policy{};  // Content-Security-Policy of a page; empty: it may do nothing
  bool streams = false;       // events of tell() follow
};

// An answer with a line of text.
[[nodiscard]] StatusAnswer plain_answer(unsigned status, const std::string& text);
// An answer with metrics, in the format that the request understands.
[[nodiscard]] StatusAnswer metrics_answer(const StatusRequest& request, SharedText metrics);

// Answers HTTP requests for the status. A connection is unauthenticated until its request was read,
// and its token if it needs one. Limits apply to the number of connections, their time, the header,
// and TLS handshakes. If all places are taken, the newest connection gets the place of another one:
// one without a request, or one that had most time to read. Connections by the socket file have
// places of their own. Thread: that of the io_context, which is not the loop's.
class StatusDoor : public std::enable_shared_from_this<StatusDoor> {
 public:
  // Connections by TCP; as many again by the file.
  static constexpr std::size_t kConnectionsMax = 32;
  static constexpr std::size_t kStreamsMax = 8;  // of these, so that there is room for others
  static constexpr std::uint32_t kHeaderBytesMax = 8192;
  static constexpr std::size_t kStreamBytesPerSecond =
      50'000;  // larger events come less often, at least every 5 s

  using Answered = std::function<void(StatusAnswer)>;
  struct Ports {
    // `answered` is called once, now or later, in the same thread.
    std::function<void(const StatusRequest&, Answered answered)> answer;
    // Judges whether the owner of this token may look: 200, 401 or 403. Called only if `tls` is
    // given.
    std::function<unsigned(const std::string& token)> judge;
    std::function<void(LogLevel, std::string)> log;
  };
  struct Times {
    std::chrono::milliseconds request{5000};  // from accept to the end of the header
    std::chrono::milliseconds answer{10'000};
  };

  StatusDoor(asio::io_context& io, Ports ports, Times times);
  StatusDoor(asio::io_context& io, Ports ports) : StatusDoor(io, std::move(ports), Times{}) {}
  ~StatusDoor();

  // Listens on a TCP address. With `tls` every reader needs a token. Returns the problem; empty:
  // none.
  [[nodiscard]] std::string listen(const std::string& address, std::uint16_t port,
                                   const std::optional<TlsOptions>& tls);
  // Listens at a socket file that only this process's user may use; close() removes it. Returns the
  // problem; empty: none.
  [[nodiscard]] std::string listen_at_file(const std::string& file);
  // The TCP port; 0: none.
  [[nodiscard]] std::uint16_t port() const;

  // Sends an event to readers that follow the stream and still may: one text for those who see
  // names, one for others.
  void tell(const SharedText& with_names, const SharedText& without);
  [[nodiscard]] std::size_t streams() const;  // readers that follow, or are about to
  // Reads certificates that have changed. Called once a second.
  void check_files();
  void close();

 private:
  class Session;
  using Sessions = std::list<std::shared_ptr<Session>>;

  [[nodiscard]] TcpDoors::Events admits(bool is_private);
  [[nodiscard]] std::size_t streams(bool is_private) const;
  void admit(TcpSocket socket, bool is_private);
  void remove(const std::shared_ptr<Session>& session);
  void note_wrong_token(const TcpSocket& socket, unsigned judged);

  asio::io_context& io_;
  const Ports ports_;
  const Times times_;
  std::shared_ptr<TcpDoors> doors_;      // null: no TCP
  std::shared_ptr<TcpDoors> file_door_;  // null: no file
  std::string file_;
  std::optional<TlsFiles> tls_;
  LogLimit wrong_tokens_;
  AddressPaces paces_{20, std::chrono::milliseconds(500)};  // TLS handshakes of one address
  Pace pace_{50, std::chrono::milliseconds(50)};            // TLS handshakes of all addresses
  Sessions sessions_;                                       // the oldest first
  std::uint64_t answers_ = 0;
};

}  // namespace connect_bridge
