#include "net/http/status_door.hpp"

#include <unistd.h>

#include <algorithm>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/span_body.hpp>
#include <boost/beast/http/write.hpp>

#include "net/http/status_request.hpp"
#include "net/tcp/proxy_header.hpp"
#include "net/tcp/steady_now.hpp"
#include "net/websocket/websocket.hpp"

namespace connect_bridge {
namespace {

constexpr std::chrono::seconds kEventsAtLeast{5};  // for events of any size
constexpr char kAcceptsNothing[] =
    "default-src 'none'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";
constexpr char kBearer[] = "Bearer ";

}  // namespace

StatusAnswer plain_answer(unsigned status, const std::string& text) {
  StatusAnswer answer;
  answer.status = status;
  answer.body = std::make_shared<const std::string>(text + "\n");
  return answer;
}

StatusAnswer metrics_answer(const StatusRequest& request, SharedText metrics) {
  return {200,
          request.open_metrics ? "application/openmetrics-text; version=1.0.0; charset=utf-8"
                               : "text/plain; version=0.0.4; charset=utf-8",
          std::move(metrics),
          {},
          false};
}

// One connection. Every path of it ends with done().
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

  // The session with the lowest rank gives way first. Ranks rise in this order: no request yet; an
  // answer, the oldest first, since its reader had most time to read; a request that waits for its
  // answer; a reader of the stream.
  [[nodiscard]] std::pair<int, std::uint64_t> keeps_its_place() const {
    constexpr int kHasNotAsked = 0, kIsAnswered = 1, kWaits = 2, kStreams = 3;
    if (streams_) return {kStreams, 0};
    if (answer_ > 0) return {kIsAnswered, answer_};
    return {has_asked_ ? kWaits : kHasNotAsked, 0};
  }
  [[nodiscard]] bool streams() const { return streams_; }
  [[nodiscard]] bool is_private() const { return is_private_; }

  void tell(const SharedText& with_names, const SharedText& without) {
    const TimePoint now = steady_now();
    if (!streams_) return;
    if (transport_.tls() && door_->ports_.judge(token_) != 200) return done();
    if (writes_ || now < next_event_) return;
    event_ = sees_names_ ? with_names : without;
    next_event_ =
        now + std::min<Duration>(std::chrono::seconds(1) * event_->size() / kStreamBytesPerSecond,
                                 kEventsAtLeast);
    writes_ = true;
    set_deadline(door_->times_.answer);
    asio::async_write(transport_, asio::buffer(*event_),
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
    const StatusGet& request = parser_.get();
    if (const auto wrong = wrong_with(request, transport_.tls()); wrong.status != 0)
      return refuse(wrong);
    if (transport_.tls() && !judge(request)) return;
    ask(request);
  }

  // Whether the reader may look; if not, the request is refused.
  bool judge(const StatusGet& request) {
    const std::string shown{request[http::field::authorization]};
    const bool bearer = shown.starts_with(kBearer);
    if (bearer) token_ = shown.substr(sizeof kBearer - 1);
    const unsigned judged = bearer ? door_->ports_.judge(token_) : 401;
    if (judged == 200) return true;  // mutant: status_token
    if (bearer) door_->note_wrong_token(transport_.socket(), judged);
    refuse({judged, judged == 401 ? "A token is needed: Authorization: Bearer ..."
                                  : "The token is right, but no group of status.groups has it."});
    return false;
  }

  void ask(const StatusGet& request) {
    has_asked_ = true;
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
    set_deadline(door_->times_.answer);
    send(plain_answer(why.status, why.text));
  }

  void send(StatusAnswer answer) {
    if (answer.streams && door_->streams(is_private_) >= kStreamsMax)
      answer = plain_answer(503, "Too many follow the events.");
    streams_ = writes_ = answer.streams;  // no event before the response is written
    if (has_asked_) answer_ = ++door_->answers_;
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
    text_ = std::move(answer.body);
    response_.body() = {text_->data(), text_->size()};
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

  // Any byte from the reader, or its end of sending, closes the stream.
  void follow() {
    writes_ = false;
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
    call_after(deadline_, time, if_alive(this, &Session::done));
  }

  StatusDoor* door_;  // null: the session is over
  Transport transport_;
  asio::steady_timer deadline_;
  const bool is_private_;
  beast::flat_buffer buffer_{kHeaderBytesMax};
  http::request_parser<http::empty_body> parser_;
  http::response<http::span_body<const char>> response_;
  SharedText text_;  // the response's body
  std::array<char, 1> end_{};
  std::string token_;  // of the request
  SharedText event_;
  TimePoint next_event_{};
  bool has_asked_ = false;
  std::uint64_t answer_ = 0;  // number of the answer to an admitted request; 0: there is none
  bool sees_names_ = false;
  bool streams_ = false;
  bool writes_ = false;  // an event, or the response before them
};

StatusDoor::StatusDoor(asio::io_context& io, Ports ports, Times times)
    : io_(io), ports_(std::move(ports)), times_(times) {}

StatusDoor::~StatusDoor() {
  close();
}

void StatusDoor::close() {
  if (doors_) doors_->close();
  if (file_door_) file_door_->close();
  if (!file_.empty()) ::unlink(file_.c_str());
  file_.clear();
  for (const auto& session : std::exchange(sessions_, {})) session->abandon();
}

TcpDoors::Events StatusDoor::admits(bool is_private) {
  return {[weak = weak_from_this(), is_private](TcpSocket socket) {
            if (const auto self = weak.lock()) self->admit(std::move(socket), is_private);
          },
          ports_.log};
}

std::string StatusDoor::listen(const std::string& address, std::uint16_t port,
                               const std::optional<TlsOptions>& tls) {
  std::string problem;
  if (tls && !tls_.emplace(*tls, Role::kServer).get(problem)) return problem;
  doors_ = std::make_shared<TcpDoors>(io_, admits(false), "status.listen");
  problem = doors_->open({address}, port);
  if (problem.empty()) doors_->accept();
  return problem;
}

std::string StatusDoor::listen_at_file(const std::string& file) {
  file_door_ = std::make_shared<TcpDoors>(io_, admits(true));
  std::string problem = file_door_->open_file(file);
  if (!problem.empty()) return problem;
  file_ = file;
  file_door_->accept();
  return {};
}

std::uint16_t StatusDoor::port() const {
  return doors_ ? doors_->port() : std::uint16_t{0};
}

void StatusDoor::check_files() {
  if (const auto news = tls_ ? tls_->check() : std::nullopt)
    ports_.log(news->used ? LogLevel::kInfo : LogLevel::kWarn, "status.listen: " + news->text);
}

void StatusDoor::admit(TcpSocket socket, bool is_private) {
  if (tls_ && !is_private) {
    ErrorCode gone;
    const auto from = socket.remote_endpoint(gone);
    const TimePoint now = steady_now();
    if (gone || !paces_.take(network_of(from.address(), 8), 1, now) || !pace_.take(now)) return;
  }
  const auto is_alike = [&](const auto& session) { return session->is_private() == is_private; };
  const bool by_tls = tls_ && !is_private;
  const TlsContext tls = by_tls ? tls_->context() : nullptr;
  if (by_tls && !tls) return;  // without TLS it would be answered without a token
  if (std::count_if(sessions_.begin(), sessions_.end(), is_alike) >=
      static_cast<std::ptrdiff_t>(kConnectionsMax)) {
    // The first session of the lowest rank gives way; readers of the stream are fewer than
    // kConnectionsMax.
    const auto gives_way = std::min_element(
        sessions_.begin(), sessions_.end(), [&](const auto& one, const auto& other) {
          return std::pair(!is_alike(one), one->keeps_its_place()) <
                 std::pair(!is_alike(other), other->keeps_its_place());
        });
    (*gives_way)->abandon();
    sessions_.erase(gives_way);
  }
  sessions_.push_back(std::make_shared<Session>(*this, std::move(socket), is_private));
  sessions_.back()->start(tls);
}

// A reader without a token is a browser that asks for one, perhaps; one with a wrong token guesses,
// or has one that was withdrawn.
void StatusDoor::note_wrong_token(const TcpSocket& socket, unsigned judged) {
  const auto count = wrong_tokens_.count({.steady = steady_now()});
  if (!count) return;
  ErrorCode gone;
  const std::string from = socket.remote_endpoint(gone).address().to_string();
  ports_.log(LogLevel::kWarn, "status.listen: refused " + from +
                                  (judged == 401 ? ", its token is wrong"
                                                 : ", no group of status.groups has its token") +
                                  left_out(*count));
}

void StatusDoor::remove(const std::shared_ptr<Session>& session) {
  sessions_.remove(session);
}

std::size_t StatusDoor::streams() const {
  return streams(true) + streams(false);
}

std::size_t StatusDoor::streams(bool is_private) const {
  return static_cast<std::size_t>(
      std::count_if(sessions_.begin(), sessions_.end(), [&](const auto& session) {
        return session->streams() && session->is_private() == is_private;
      }));
}

void StatusDoor::tell(const SharedText& with_names, const SharedText& without) {
  for (const auto& session : Sessions(sessions_)) session->tell(with_names, without);
}

}  // namespace connect_bridge
