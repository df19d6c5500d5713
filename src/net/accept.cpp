#include "net/accept.hpp"

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
#include <optional>

#include "core/wire/login.hpp"
#include "net/websocket.hpp"

namespace connect_bridge {
namespace {

constexpr std::uint32_t kRequestHeaderBytesMax = 8192;
constexpr std::chrono::milliseconds kRefusalTime{1000};
constexpr char kServerName[] = "ROS2 Connect";
constexpr char kForwardedHeader[] = "X-Forwarded-For";

using UpgradeRequest = http::request<http::empty_body>;

struct Refusal {
  http::status status;
  std::string text;
};

std::string to_string(beast::string_view text) {
  return {text.data(), text.size()};
}

// Detects both versions, where HTTP was expected. The parser may have passed over empty lines.
bool is_proxy_protocol(asio::const_buffer received) {
  const std::string_view text{static_cast<const char*>(received.data()), received.size()};
  constexpr std::string_view kVersion2{"\0\r\nQUIT\n", 8};
  return text.starts_with("PROXY ") || text.substr(0, 12).find(kVersion2) != std::string_view::npos;
}

// Why the request does not open a connection of this protocol.
std::optional<Refusal> refusal_of(const UpgradeRequest& request, const AcceptOptions& options) {
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
                       (options.tls ? "wss://" : "ws://") + to_string(request[http::field::host]) +
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

// Handshakes wait for their turn for as long as so many may take.
constexpr int kWaitTimes = 4;

}  // namespace

bool names_subprotocol(beast::string_view list) {
  return http::token_list{list}.exists(kSubprotocol);
}

struct Acceptance::Request {
  beast::flat_buffer buffer{kRequestHeaderBytesMax};
  http::request_parser<http::empty_body> parser;
  http::response<http::string_body> response;
};

Acceptance::Acceptance(TcpSocket socket, std::shared_ptr<const AcceptOptions> options,
                       Identify identify, AwaitTurn await_turn)
    : options_(std::move(options)),
      socket_(std::make_shared<WebSocket>(std::move(socket))),
      request_(std::make_unique<Request>()),
      identify_(std::move(identify)),
      await_turn_(std::move(await_turn)),
      deadline_(socket_->get_executor()) {
  request_->parser.header_limit(kRequestHeaderBytesMax);
}

Acceptance::~Acceptance() = default;

void Acceptance::start(Done done) {
  done_ = std::move(done);
  if (!identify_ || options_->told_by != ToldBy::kProxyProtocol) return line_up();
  set_deadline(options_->timeout);
  read_proxy();
}

// No byte more than the header: what follows belongs to TLS or HTTP.
void Acceptance::read_proxy() {
  const ProxyHeader header = read_proxy_header(proxy_header_);
  if (header.state == ProxyHeader::State::kWrong) {
    notice_ =
        "refused, since this trusted proxy sends no header of the PROXY protocol "
        "(listen.proxy_header)";
    return fail(notice_);
  }
  if (header.state == ProxyHeader::State::kComplete) {
    if (identified(header.source)) line_up();
    return;
  }
  const std::size_t have = proxy_header_.size();
  proxy_header_.resize(have + header.missing);
  asio::async_read(socket_->next_layer().socket(),
                   asio::buffer(proxy_header_.data() + have, header.missing),
                   [self = shared_from_this()](ErrorCode error, std::size_t) {
                     if (!self->done_) return;
                     if (error) return self->fail(failure_text(error, nullptr, {}));
                     self->read_proxy();
                   });
}

bool Acceptance::identified(const std::optional<Source>& source) {
  const bool may_go_on = identify_(source);
  if (!may_go_on) fail("dropped, too many handshakes");
  return may_go_on;
}

bool Acceptance::read_forwarded() {
  if (!identify_) return notice_unheard(), true;
  if (options_->told_by == ToldBy::kProxyProtocol) return true;
  const auto fields = request_->parser.get().equal_range(kForwardedHeader);
  std::vector<std::string_view> lines;
  for (auto field = fields.first; field != fields.second; ++field)
    lines.emplace_back(field->value().data(), field->value().size());
  const auto source = forwarded_source(lines, options_->proxies);
  if (!source)
    notice_ = std::string{"this trusted proxy does not say in "} + kForwardedHeader +
              " for whom it connects: limits count its own address";
  return identified(source);
}

void Acceptance::notice_unheard() {
  if (request_->parser.get().count(kForwardedHeader) == 0) return;
  notice_ = std::string{"its "} + kForwardedHeader +
            " is ignored, since listen.trusted_proxies does not name it: limits count its address";
}

void Acceptance::line_up() {
  set_deadline(kWaitTimes * options_->timeout);
  const AwaitTurn await_turn = std::move(await_turn_);  // it may end this one
  await_turn(shared_from_this());
}

void Acceptance::begin() {
  if (!done_) return;
  set_deadline(options_->timeout);  // mutant: handshake_time
  if (!options_->tls) return read_request();
  Transport& transport = socket_->next_layer();
  transport.start_tls(options_->tls);
  transport.async_tls_handshake(
      true, [self = shared_from_this()](ErrorCode error) { self->on_tls(error); });
}

void Acceptance::on_tls(const ErrorCode& error) {
  if (!done_) return;
  if (!error) return read_request();
  if (is_plain_http(error)) return answer_plain_http();
  fail("TLS: " + failure_text(error, socket_->next_layer().tls(), {}));
}

// Written below TLS: a client that sent plain HTTP cannot read anything else.
void Acceptance::answer_plain_http() {
  static constexpr char kAnswer[] =
      "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\nConnection: close\r\n\r\n"
      "This is a ROS2 Connect server with TLS: use wss:// instead of ws://.\n";
  problem_ = "plain HTTP on a TLS port";
  set_deadline(kRefusalTime);
  TcpSocket& socket = socket_->next_layer().socket();
  asio::async_write(socket, asio::buffer(kAnswer, sizeof kAnswer - 1),
                    [self = shared_from_this()](ErrorCode, std::size_t) {
                      if (!self->done_) return;
                      self->socket_->next_layer().finish([self] { self->fail(self->problem_); });
                    });
}

void Acceptance::read_request() {
  http::async_read_header(
      socket_->next_layer(), request_->buffer, request_->parser,
      [self = shared_from_this()](ErrorCode error, std::size_t) { self->on_request(error); });
}

void Acceptance::on_request(const ErrorCode& error) {
  if (!done_) return;
  if (error == http::error::header_limit || error == http::error::buffer_overflow) {
    return refuse(431, "The HTTP header is too long.");
  }
  if (error && is_proxy_protocol(request_->buffer.cdata())) {
    notice_ =
        "its header of the PROXY protocol is refused: listen.trusted_proxies does not name it, or "
        "listen.proxy_header is not proxy_protocol";
  }
  const bool http = error.category() == make_error_code(http::error::bad_version).category();
  if (error && http && error != http::error::end_of_stream &&
      error != http::error::partial_message) {
    return refuse(400, "This is no HTTP request: " + error.message() + ".");
  }
  if (error) return fail(failure_text(error, socket_->next_layer().tls(), {}));
  if (!read_forwarded()) return;
  const UpgradeRequest& request = request_->parser.get();
  if (const auto refusal = refusal_of(request, *options_)) {
    return refuse(static_cast<unsigned>(refusal->status), refusal->text);
  }
  if (request_->buffer.size() > 0) {
    return refuse(400, "Nothing may follow the request before it is answered.");
  }
  slot_ = options_->reserve();
  if (!slot_) return refuse(503, "All connections of this server are taken; try again later.");
  upgrade();
}

void Acceptance::upgrade() {
  socket_->set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(http::field::server, kServerName);
    response.set(http::field::sec_websocket_protocol, kSubprotocol);
  }));
  socket_->async_accept(request_->parser.get(), [self = shared_from_this()](ErrorCode error) {
    if (!self->done_) return;
    if (error) return self->fail("upgrade: " + error.message());
    self->finish({std::move(self->socket_), std::move(self->slot_), {}, {}});
  });
}

void Acceptance::refuse(unsigned status, const std::string& text) {
  problem_ = "HTTP " + std::to_string(status) + ": " + text;
  set_deadline(kRefusalTime);
  auto& response = request_->response;
  response.result(status);
  response.version(11);
  response.set(http::field::server, kServerName);
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
  http::async_write(socket_->next_layer(), response,
                    [self = shared_from_this()](ErrorCode error, std::size_t) {
                      if (!self->done_) return;
                      if (error) return self->fail(self->problem_);
                      self->socket_->next_layer().finish([self] { self->fail(self->problem_); });
                    });
}

void Acceptance::fail(std::string problem) {
  if (!done_) return;
  socket_->next_layer().abort();
  finish({nullptr, nullptr, std::move(problem), {}});
}

void Acceptance::finish(Accepted accepted) {
  deadline_.cancel();
  identify_ = nullptr;
  await_turn_ = nullptr;
  const Done done = std::move(done_);
  done_ = nullptr;
  slot_.reset();
  accepted.notice = std::move(notice_);
  done(std::move(accepted));
}

void Acceptance::abandon() {
  done_ = nullptr;
  identify_ = nullptr;
  await_turn_ = nullptr;
  deadline_.cancel();
  slot_.reset();
  if (socket_) socket_->next_layer().abort();
}

void Acceptance::set_deadline(std::chrono::milliseconds time) {
  deadline_.expires_after(time);
  deadline_.async_wait([weak = weak_from_this()](ErrorCode error) {
    const auto self = weak.lock();
    if (!self || error || !self->done_) return;
    self->fail(self->problem_.empty() ? "no complete request in time" : self->problem_);
  });
}

}  // namespace connect_bridge
