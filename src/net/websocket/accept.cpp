#include "net/websocket/accept.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <cerrno>
#include <optional>

#include "core/wire/login.hpp"
#include "net/relay/relay_wire.hpp"
#include "net/tls/client_hello.hpp"
#include "net/websocket/websocket.hpp"

namespace connect_bridge {
namespace {

constexpr std::uint32_t kRequestHeaderBytesMax = 8192;
constexpr std::chrono::milliseconds kRefusalTime{1000};
constexpr char kForwardedHeader[] = "X-Forwarded-For";

using UpgradeRequest = http::request<http::empty_body>;

struct Refusal {
  http::status status;
  std::string text;
};

std::string to_string(beast::string_view text) {
  return {text.data(), text.size()};
}

constexpr char kHeaderRefused[] =
    "its header of the PROXY protocol is refused: listen.trusted_proxies does not name it, or "
    "listen.proxy_header is not proxy_protocol";

// Detects both versions, where HTTP was expected. The parser may have passed over empty lines.
bool is_proxy_protocol(asio::const_buffer received) {
  const std::string_view text{static_cast<const char*>(received.data()), received.size()};
  constexpr std::string_view kVersion2{"\0\r\nQUIT\n", 8};
  return text.starts_with("PROXY ") || text.substr(0, 12).find(kVersion2) != std::string_view::npos;
}

// Why the request does not open a connection of this protocol.
std::optional<Refusal> refusal_of(const UpgradeRequest& request, bool secure) {
  const std::string target = to_string(request.target());
  const std::string path = target.substr(0, target.find('?'));
  const std::string here = "This is a ROS2 Connect server. ";
  if (request.method() != http::verb::get) {
    return Refusal{http::status::method_not_allowed, here + "It answers GET only."};
  }
  if (!websocket::is_upgrade(request)) {
    return Refusal{http::status::upgrade_required,
                   here + "Connect with a WebSocket of the subprotocol " + kSubprotocol +
                       ":\n  ros2 run connect_bridge client --ros-args -p url:=" +
                       (secure ? "wss://" : "ws://") + to_string(request[http::field::host]) +
                       path};
  }
  if (!names_subprotocol(request[http::field::sec_websocket_protocol])) {
    return Refusal{http::status::bad_request,
                   here + "The WebSocket must offer the subprotocol " + kSubprotocol +
                       "; yours offers '" + to_string(request["Sec-WebSocket-Protocol"]) + "'."};
  }
  // Any web page can open a WebSocket from its visitor's browser into the visitor's network.
  // Programs send no origin and are not concerned.
  if (!request[http::field::origin].empty()) {  // mutant: web_pages
    return Refusal{http::status::forbidden, here + "Web pages of this origin may not connect."};
  }
  return std::nullopt;
}

constexpr std::size_t kHeaderBytesSeen = 12;  // the signature of version 2
// One of ours has some 400 bytes, and comes in one segment. What comes in several shows no word.
constexpr std::size_t kHelloBytesSeen = 2048;

// Handshakes wait for their turn for as long as so many may take.
constexpr int kWaitTimes = 4;

}  // namespace

bool names_subprotocol(beast::string_view list) {
  return http::token_list{list}.exists(kSubprotocol);
}

struct Listener::Visitor::Request {
  beast::flat_buffer buffer{kRequestHeaderBytesMax};
  http::request_parser<http::empty_body> parser;
  http::response<http::string_body> response;
};

Listener::Visitor::Visitor(Listener& listener, TcpSocket tcp, ConnectionOpened opened, By sender)
    : from(std::move(opened)),
      by(sender),
      socket(std::make_shared<WebSocket>(std::move(tcp))),
      listener_(&listener),
      request_(std::make_unique<Request>()),
      deadline_(listener.io_),
      traffic_(header_bytes_of(socket->next_layer().socket().native_handle())) {
  request_->parser.header_limit(kRequestHeaderBytesMax);
}

Listener::Visitor::~Visitor() = default;

void Listener::Visitor::start() {
  if (by != By::kProxy || listener_->options_.named_by != NamedBy::kProxyProtocol)
    return await_hello();
  set_deadline(listener_->options_.handshake_timeout);
  read_proxy();
}

// No byte more than the header: what follows belongs to TLS or HTTP.
void Listener::Visitor::read_proxy() {
  const ProxyHeader header = read_proxy_header(proxy_header_);
  if (header.state == ProxyHeader::State::kWrong) {
    notice =
        "refused, since this trusted proxy sends no header of the PROXY protocol "
        "(listen.proxy_header)";
    return fail(notice);
  }
  if (header.state == ProxyHeader::State::kComplete) {
    listener_->identify(*this, header.source);
    return await_hello();
  }
  const std::size_t have = proxy_header_.size();
  proxy_header_.resize(have + header.missing);
  asio::async_read(socket->next_layer().socket(),
                   asio::buffer(proxy_header_.data() + have, header.missing),
                   [self = shared_from_this()](ErrorCode error, std::size_t) {
                     if (!self->listener_) return;
                     if (error) return self->fail(failure_of(error, nullptr, {}).text);
                     self->read_proxy();
                   });
}

// A silent connection uses up none of the handshakes that its address may begin.
void Listener::Visitor::await_hello() {
  if (!listener_->tls_) return line_up();
  set_deadline(listener_->options_.handshake_timeout);
  look_for_hello();
}

void Listener::Visitor::look_for_hello() {
  TcpSocket& tcp = socket->next_layer().socket();
  tcp.async_wait(TcpSocket::wait_read, [self = shared_from_this(), &tcp](ErrorCode error) {
    if (!self->listener_) return;
    if (error) return self->fail(failure_of(error, nullptr, {}).text);
    std::array<char, kHeaderBytesSeen> first{};
    const ssize_t got =
        ::recv(tcp.native_handle(), first.data(), first.size(), MSG_PEEK | MSG_DONTWAIT);
    // A late event of a closed descriptor can wake the next one with its number.
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return self->look_for_hello();
    if (got <= 0) return self->fail("the connection ended before TLS");
    // Behind the header of a trusted proxy another one is no business of this one's settings.
    const bool header =
        is_proxy_protocol(asio::buffer(first.data(), static_cast<std::size_t>(got)));
    if (header && self->proxy_header_.empty()) {
      self->note_header();
      return self->fail(kHeaderRefused);
    }
    if (!self->listener_->on_hello(*self)) return self->fail("dropped, too many handshakes");
    self->line_up();
  });
}

std::vector<std::string> Listener::Visitor::offered() const {
  Bytes hello(kHelloBytesSeen);
  const ssize_t got = ::recv(socket->next_layer().socket().native_handle(), hello.data(),
                             hello.size(), MSG_PEEK | MSG_DONTWAIT);
  hello.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  std::vector<std::string> protocols = read_client_hello(hello).protocols;
  protocols.resize(std::min(protocols.size(), kClientWordsMax + 2));
  return protocols;
}

void Listener::Visitor::note_header() {
  ++listener_->counts_.proxy_headers;
  notice = kHeaderRefused;
}

void Listener::Visitor::read_forwarded() {
  const auto fields = request_->parser.get().equal_range(kForwardedHeader);
  if (by != By::kProxy) {
    if (fields.first != fields.second)
      notice = std::string{"its "} + kForwardedHeader +
               " is ignored, since listen.trusted_proxies does not name it: limits count its "
               "address";
    return;
  }
  if (listener_->options_.named_by == NamedBy::kProxyProtocol) return;
  std::vector<std::string_view> lines;
  for (auto field = fields.first; field != fields.second; ++field)
    lines.emplace_back(field->value().data(), field->value().size());
  const auto source = forwarded_source(lines, listener_->proxies_);
  if (!source)
    notice = std::string{"this trusted proxy does not say in "} + kForwardedHeader +
             " for whom it connects: limits count its own address";
  listener_->identify(*this, source);
}

void Listener::Visitor::line_up() {
  set_deadline(kWaitTimes * listener_->options_.handshake_timeout);
  listener_->line_up(shared_from_this());  // which may end this one
}

void Listener::Visitor::begin() {
  if (!listener_) return;
  set_deadline(listener_->options_.handshake_timeout);  // mutant: handshake_time
  if (!listener_->tls_) return read_request();
  Transport& transport = socket->next_layer();
  transport.start_tls(listener_->tls_->context());
  transport.async_tls_handshake(
      true, [self = shared_from_this()](ErrorCode error) { self->on_tls(error); });
}

void Listener::Visitor::on_tls(const ErrorCode& error) {
  if (!listener_) return;
  if (!error) return read_request();
  if (is_plain_http(error)) return answer_plain_http();
  fail("TLS: " + failure_of(error, socket->next_layer().tls(), {}).text);
}

// Written below TLS: a client that sent plain HTTP cannot read anything else.
void Listener::Visitor::answer_plain_http() {
  static constexpr char kAnswer[] =
      "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\n"
      "Upgrade: TLS/1.2, HTTP/1.1\r\nConnection: close, upgrade\r\n\r\n"
      "This is a ROS2 Connect server with TLS: use wss:// instead of ws://.\n";
  problem_ = "plain HTTP on a TLS port";
  set_deadline(kRefusalTime);
  asio::async_write(
      socket->next_layer().socket(), asio::buffer(kAnswer, sizeof kAnswer - 1),
      [self = shared_from_this()](ErrorCode error, std::size_t) { self->on_answered(error); });
}

// The answer is to arrive before the end does.
void Listener::Visitor::on_answered(const ErrorCode& error) {
  if (!listener_) return;
  if (error) return fail(problem_);
  count_traffic();
  socket->next_layer().finish([self = shared_from_this()] { self->fail(self->problem_); });
}

void Listener::Visitor::read_request() {
  http::async_read_header(
      socket->next_layer(), request_->buffer, request_->parser,
      [self = shared_from_this()](ErrorCode error, std::size_t) { self->on_request(error); });
}

void Listener::Visitor::on_request(const ErrorCode& error) {
  if (!listener_) return;
  if (error == http::error::header_limit || error == http::error::buffer_overflow) {
    return refuse(431, "The HTTP header is too long.");
  }
  if (error && is_proxy_protocol(request_->buffer.cdata())) {
    note_header();
    return refuse(400, "This is no HTTP request, but a header of the PROXY protocol.");
  }
  const bool http = error.category() == make_error_code(http::error::bad_version).category();
  if (error && http && error != http::error::end_of_stream &&
      error != http::error::partial_message) {
    return refuse(400, "This is no HTTP request: " + error.message() + ".");
  }
  if (error) return fail(failure_of(error, socket->next_layer().tls(), {}).text);
  read_forwarded();
  const UpgradeRequest& request = request_->parser.get();
  if (const auto refusal = refusal_of(request, listener_->tls_.has_value())) {
    return refuse(static_cast<unsigned>(refusal->status), refusal->text);
  }
  if (request_->buffer.size() > 0) {
    return refuse(400, "Nothing may follow the request before it is answered.");
  }
  place = listener_->admission_->take_connection();
  if (!place) return refuse(503, "All connections of this server are taken; try again later.");
  upgrade();
}

void Listener::Visitor::upgrade() {
  socket->set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(http::field::server, kProgramName);
    response.set(http::field::sec_websocket_protocol, kSubprotocol);
  }));
  socket->async_accept(request_->parser.get(), [self = shared_from_this()](ErrorCode error) {
    if (!self->listener_) return;
    if (error) return self->fail("upgrade: " + error.message());
    self->end()->on_open(self);
  });
}

void Listener::Visitor::refuse(unsigned status, const std::string& text) {
  problem_ = "HTTP " + std::to_string(status) + ": " + text;
  set_deadline(kRefusalTime);
  auto& response = request_->response;
  response.result(status);
  response.version(11);
  response.set(http::field::server, kProgramName);
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  response.set(http::field::connection, "close");
  if (response.result() == http::status::upgrade_required) {
    response.set(http::field::upgrade, "websocket");
    response.set(http::field::connection, "close, upgrade");
  }
  if (response.result() == http::status::service_unavailable) {
    response.set(http::field::retry_after, "5");
  }
  response.body() = text + "\n";
  response.prepare_payload();
  response.keep_alive(false);
  http::async_write(
      socket->next_layer(), response,
      [self = shared_from_this()](ErrorCode error, std::size_t) { self->on_answered(error); });
}

void Listener::Visitor::fail(const std::string& problem) {
  if (!listener_) return;
  abort();
  end()->on_refused(shared_from_this(), problem);
}

Listener* Listener::Visitor::end() {
  deadline_.cancel();
  return std::exchange(listener_, nullptr);
}

void Listener::Visitor::abandon() {
  end();
  abort();
}

void Listener::Visitor::count_traffic() {
  traffic_.count(tcp_counts_of(socket->next_layer().socket().native_handle()));
}

void Listener::Visitor::abort() {
  count_traffic();
  place.reset();
  slot.reset();
  relay_slot.reset();
  socket->next_layer().abort();
}

void Listener::Visitor::set_deadline(std::chrono::milliseconds time) {
  call_after(deadline_, time, if_alive(this, &Visitor::on_deadline));
}

void Listener::Visitor::on_deadline() {
  fail(problem_.empty() ? "no complete request in time" : problem_);
}

}  // namespace connect_bridge
