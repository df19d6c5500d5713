#include "net/status_door.hpp"

#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <cerrno>
#include <cstring>

#include "net/listen_at.hpp"
#include "net/proxy_header.hpp"
#include "net/steady_now.hpp"
#include "net/websocket.hpp"

namespace connect_bridge {
namespace {

constexpr std::chrono::milliseconds kAcceptRetry{100};
constexpr std::chrono::seconds kEventsAtLeast{5};  // however large they are
constexpr char kAcceptsNothing[] =
    "default-src 'none'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";
constexpr char kBearer[] = "Bearer ";

using StatusGet = http::request<http::empty_body>;

// The host of "robot:9091" or "[::1]:9091" without its port; nullopt: it is no such text.
std::optional<std::string> host_without_port(std::string_view text) {
  const bool bracket = text.starts_with('[');
  const std::size_t end = bracket ? text.find(']') : text.find(':');
  if (bracket && end == std::string_view::npos) return std::nullopt;
  const std::string_view rest = text.substr(std::min(text.size(), bracket ? end + 1 : end));
  if (!rest.empty() &&
      (rest[0] != ':' || rest.find_first_not_of("0123456789", 1) != std::string_view::npos))
    return std::nullopt;
  return std::string{bracket ? text.substr(1, end - 1) : text.substr(0, end)};
}

// A web page whose name leads to this machine (DNS rebinding) shows that name here. It cannot show
// an address, or "localhost"; names of our certificate are ours.
bool is_own_host(std::string_view text, SSL* tls) {
  const auto host = host_without_port(text);
  if (!host) return false;
  ErrorCode no_address;
  asio::ip::make_address(*host, no_address);
  if (!no_address || beast::iequals(*host, "localhost")) return true;  // mutant: foreign_host
  X509* const own = tls ? SSL_get_certificate(tls) : nullptr;
  return own && X509_check_host(own, host->data(), host->size(), 0, nullptr) == 1;
}

struct StatusRefusal {
  unsigned status = 0;  // 0: none
  std::string text;
};

// What is wrong with the request, whoever sent it.
StatusRefusal wrong_with(const StatusGet& request, SSL* tls) {
  if (request.method() != http::verb::get) return {405, "Only GET is answered here."};
  if (request.count(http::field::host) != 1) return {400, "One Host is needed."};
  const auto host = request[http::field::host];
  if (!is_own_host({host.data(), host.size()}, tls))
    return {421,
            "This host is not served here: use localhost, an IP address, or a name of the "
            "certificate."};
  if (!request.target().starts_with('/')) return {400, "A path is needed."};
  if (request.count(http::field::transfer_encoding) + request.count(http::field::content_length))
    return {400, "A request has no body here."};
  if (request.count(http::field::origin)) return {403, "Pages of elsewhere may not ask here."};
  return {};
}

}  // namespace

// One connection. It ends by done(), which is called in each way that it can take.
class StatusDoor::Session : public std::enable_shared_from_this<Session> {
 public:
  Session(StatusDoor& door, TcpSocket socket, bool is_private)
      : door_(&door),
        transport_(std::move(socket)),
        deadline_(transport_.get_executor()),
        is_private_(is_private) {
    parser_.header_limit(kHeaderBytesMax);
  }

  void start(const TlsContext& tls) {
    set_deadline(door_->times_.request);
    if (!tls) return read();
    transport_.start_tls(tls);
    transport_.async_tls_handshake(true, [self = shared_from_this()](ErrorCode error) {
      if (!self->door_) return;
      error ? self->done() : self->read();
    });
  }

  void abandon() {
    door_ = nullptr;
    deadline_.cancel();
    transport_.abort();
  }

  [[nodiscard]] bool has_asked() const { return has_asked_; }
  [[nodiscard]] bool streams() const { return streams_; }

  void tell(const std::string& with_names, const std::string& without) {
    const TimePoint now = steady_now();
    if (!streams_ || writes_ || now < next_event_) return;
    event_ = "data: " + (sees_names_ ? with_names : without) + "\n\n";
    next_event_ =
        now + std::min<Duration>(std::chrono::seconds(1) * event_.size() / kStreamBytesPerSecond,
                                 kEventsAtLeast);
    writes_ = true;
    set_deadline(door_->times_.answer);
    asio::async_write(transport_, asio::buffer(event_),
                      [self = shared_from_this()](ErrorCode error, std::size_t) {
                        if (!self->door_) return;
                        if (error) return self->done();
                        self->writes_ = false;
                        self->deadline_.cancel();
                      });
  }

 private:
  void read() {
    http::async_read_header(
        transport_, buffer_, parser_,
        [self = shared_from_this()](ErrorCode error, std::size_t) { self->on_request(error); });
  }

  void on_request(const ErrorCode& error) {
    if (!door_) return;
    if (error == http::error::header_limit || error == http::error::buffer_overflow)
      return refuse({431, "The HTTP header is too long."});
    const bool http = error.category() == make_error_code(http::error::bad_version).category();
    if (error && http && error != http::error::end_of_stream &&
        error != http::error::partial_message)
      return refuse({400, "This is no HTTP request."});
    if (error) return done();
    has_asked_ = true;
    const StatusGet& request = parser_.get();
    if (const auto wrong = wrong_with(request, transport_.tls()); wrong.status != 0)
      return refuse(wrong);
    if (transport_.tls() && !judge(request)) return;
    ask(request);
  }

  // Whether it may look; else it is refused.
  bool judge(const StatusGet& request) {
    const std::string shown{request[http::field::authorization]};
    const bool bearer = shown.starts_with(kBearer);
    const unsigned judged = bearer ? door_->ports_.judge(shown.substr(sizeof kBearer - 1)) : 401;
    if (judged == 200) return true;  // mutant: status_token
    refuse({judged, judged == 401 ? "A token is needed: Authorization: Bearer ..."
                                  : "The token is right, but no group of status.groups has it."});
    return false;
  }

  void ask(const StatusGet& request) {
    const std::string target{request.target()};
    StatusRequest asked{target.substr(0, target.find('?')), false, false};
    asked.open_metrics =
        request[http::field::accept].find("application/openmetrics-text") != std::string::npos;
    sees_names_ = is_private_ || transport_.tls();  // mutant: names_of_people
    asked.sees_names = sees_names_;
    set_deadline(door_->times_.answer);
    door_->ports_.answer(asked, [self = shared_from_this()](StatusAnswer answer) {
      if (self->door_) self->send(std::move(answer));
    });
  }

  void refuse(const StatusRefusal& why) {
    has_asked_ = true;
    set_deadline(door_->times_.answer);
    send({why.status, "text/plain; charset=utf-8", why.text + "\n", {}, false});
  }

  void send(StatusAnswer answer) {
    if (answer.streams && door_->streams() >= kStreamsMax)
      answer = {503, "text/plain; charset=utf-8", "Too many follow the events.\n", {}, false};
    response_.result(answer.status);
    response_.version(11);
    response_.set(http::field::connection, "close");
    response_.set(http::field::content_type, answer.type);
    response_.set(http::field::cache_control, "no-store");
    response_.set("Content-Security-Policy",
                  answer.page_policy.empty() ? kAcceptsNothing : answer.page_policy);
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set("Referrer-Policy", "no-referrer");
    response_.set("Cross-Origin-Resource-Policy", "same-origin");
    if (answer.status == 405) response_.set(http::field::allow, "GET");
    if (answer.status == 401) response_.set(http::field::www_authenticate, "Bearer");
    if (answer.status == 503) response_.set(http::field::retry_after, "1");
    response_.body() = std::move(answer.body);
    if (!answer.streams) response_.prepare_payload();
    http::async_write(
        transport_, response_,
        [self = shared_from_this(), streams = answer.streams](ErrorCode error, std::size_t) {
          if (!self->door_) return;
          if (error) return self->done();
          if (streams) return self->follow();
          self->transport_.finish([self] { self->done(); });
        });
  }

  // Whatever it sends now, or its end, ends the stream.
  void follow() {
    streams_ = true;
    deadline_.cancel();
    transport_.async_read_some(asio::buffer(end_),
                               [self = shared_from_this()](ErrorCode, std::size_t) {
                                 if (self->door_) self->done();
                               });
  }

  void done() {
    StatusDoor* const door = door_;
    if (!door) return;
    abandon();
    door->remove(shared_from_this());
  }

  void set_deadline(std::chrono::milliseconds time) {
    deadline_.expires_after(time);
    deadline_.async_wait([weak = weak_from_this()](ErrorCode cancelled) {
      if (const auto self = weak.lock(); self && !cancelled) self->done();
    });
  }

  StatusDoor* door_;  // null: it has ended
  Transport transport_;
  asio::steady_timer deadline_;
  const bool is_private_;
  beast::flat_buffer buffer_{kHeaderBytesMax};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
  std::array<char, 1> end_{};
  std::string event_;
  TimePoint next_event_{};
  bool has_asked_ = false;
  bool sees_names_ = false;
  bool streams_ = false;
  bool writes_ = false;  // an event
};

StatusDoor::StatusDoor(asio::io_context& io, Ports ports, Times times)
    : io_(io), ports_(std::move(ports)), times_(times), door_(io), file_door_(io), retry_(io) {}

StatusDoor::~StatusDoor() {
  close();
}

void StatusDoor::close() {
  ErrorCode ignored;
  door_.close(ignored);
  file_door_.close(ignored);
  retry_.cancel();
  if (!file_.empty()) ::unlink(file_.c_str());
  file_.clear();
  for (const auto& session : std::exchange(sessions_, {})) session->abandon();
}

std::string StatusDoor::listen(const std::string& address, std::uint16_t port,
                               const std::optional<TlsOptions>& tls) {
  if (tls) {
    std::string problem;
    tls_files_.emplace(*tls, Role::kServer);
    tls_ = tls_files_->get(problem);
    if (!tls_) return problem;
  }
  const ListenResult result = listen_at(door_, address, port, "status.listen");
  if (!result.warning.empty()) ports_.log(LogLevel::kWarn, result.warning);
  if (result.problem.empty()) accept();
  return result.problem;
}

// Nobody can connect before listen(), and then the mode is right.
std::string StatusDoor::listen_at_file(const std::string& file) {
  if (file.size() >= sizeof(sockaddr_un::sun_path)) return file + ": the path is too long";
  ::unlink(file.c_str());
  ErrorCode error;
  file_door_.open({}, error);
  if (!error) file_door_.bind({file}, error);
  if (!error && ::chmod(file.c_str(), S_IRUSR | S_IWUSR) != 0)
    error = {errno, boost::system::system_category()};
  if (!error) file_door_.listen(asio::socket_base::max_listen_connections, error);
  if (error) return file + ": " + error.message();
  file_ = file;
  accept_at_file();
  return {};
}

std::uint16_t StatusDoor::port() const {
  ErrorCode none;
  return door_.is_open() ? door_.local_endpoint(none).port() : std::uint16_t{0};
}

void StatusDoor::check_files() {
  const auto news = tls_files_ ? tls_files_->check() : std::nullopt;
  if (!news) return;
  std::string problem;
  if (news->used) tls_ = tls_files_->get(problem);
  ports_.log(news->used ? LogLevel::kInfo : LogLevel::kWarn, "status.listen: " + news->text);
}

void StatusDoor::accept() {
  door_.async_accept(io_.get_executor(),
                     [weak = weak_from_this()](ErrorCode error, TcpSocket socket) {
                       const auto self = weak.lock();
                       if (!self || !self->door_.is_open()) return;
                       if (error) return self->retry([&door = *self] { door.accept(); });
                       self->admit(std::move(socket), false);
                       self->accept();
                     });
}

// A transport asks nothing of its socket that only TCP has, so it gets the descriptor of any.
void StatusDoor::accept_at_file() {
  file_door_.async_accept(
      [weak = weak_from_this()](ErrorCode error, asio::local::stream_protocol::socket from) {
        const auto self = weak.lock();
        if (!self || !self->file_door_.is_open()) return;
        if (error) return self->retry([&door = *self] { door.accept_at_file(); });
        TcpSocket socket(self->io_);
        ErrorCode failed;
        socket.assign(asio::ip::tcp::v4(), from.release(failed), failed);
        if (!failed) self->admit(std::move(socket), true);
        self->accept_at_file();
      });
}

// Out of descriptors: asking again at once would spin.
void StatusDoor::retry(std::function<void()> accept) {
  retry_.expires_after(kAcceptRetry);
  retry_.async_wait([weak = weak_from_this(), accept = std::move(accept)](ErrorCode cancelled) {
    if (const auto self = weak.lock(); self && !cancelled) accept();
  });
}

void StatusDoor::admit(TcpSocket socket, bool is_private) {
  if (tls_ && !is_private) {
    ErrorCode gone;
    const auto from = socket.remote_endpoint(gone);
    const TimePoint now = steady_now();
    if (gone || !paces_.take(network_of(from.address(), 8), 1, now) || !pace_.take(now)) return;
  }
  if (sessions_.size() >= kConnectionsMax) {
    const auto slow = std::find_if(sessions_.begin(), sessions_.end(),
                                   [](const auto& session) { return !session->has_asked(); });
    if (slow == sessions_.end()) return;
    (*slow)->abandon();
    sessions_.erase(slow);
  }
  sessions_.push_back(std::make_shared<Session>(*this, std::move(socket), is_private));
  sessions_.back()->start(is_private ? nullptr : tls_);
}

void StatusDoor::remove(const std::shared_ptr<Session>& session) {
  sessions_.remove(session);
}

std::size_t StatusDoor::streams() const {
  return static_cast<std::size_t>(std::count_if(
      sessions_.begin(), sessions_.end(), [](const auto& session) { return session->streams(); }));
}

void StatusDoor::tell(const std::string& with_names, const std::string& without) {
  for (const auto& session : Sessions(sessions_)) session->tell(with_names, without);
}

}  // namespace connect_bridge
