#include "net/dial.hpp"

#include <algorithm>
#include <boost/beast/http/field.hpp>
#include <boost/beast/http/status.hpp>
#include <boost/beast/websocket/error.hpp>

#include "core/wire/login.hpp"
#include "net/http_proxy.hpp"
#include "net/socket_tuning.hpp"
#include "net/websocket.hpp"

namespace connect_bridge {
namespace {

constexpr std::chrono::seconds kFirstAttempt{1};

// The first line of what a server or proxy answered, made harmless for a log.
std::string first_line(const std::string& body) {
  std::string line = body.substr(0, std::min<std::size_t>(body.find_first_of("\r\n"), 200));
  const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  line.erase(std::remove_if(line.begin(), line.end(), control), line.end());
  return line;
}

}  // namespace

struct Dialing::Response {
  websocket::response_type http;
};

Dialing::Dialing(asio::io_context& io, DialOptions options, SocketOptions sockets, TlsContext tls)
    : io_(io),
      options_(std::move(options)),
      sockets_(std::move(sockets)),
      resolver_(io),
      deadline_(io),
      attempt_(io),
      tls_(std::move(tls)),
      response_(std::make_unique<Response>()) {}

Dialing::~Dialing() = default;

void Dialing::start(Done done) {
  done_ = std::move(done);
  end_ = std::chrono::steady_clock::now() + options_.timeout;
  stage_ = "the name look-up";
  deadline_.expires_at(end_);
  deadline_.async_wait([weak = weak_from_this()](ErrorCode error) {
    const auto self = weak.lock();
    if (self && !error) self->fail("no answer in time (" + self->stage_ + ")");
  });
  if (!options_.url.secure || tls_) resolve();
}

void Dialing::resolve() {
  const std::string& host = options_.proxy ? options_.proxy->host : options_.url.host;
  const std::uint16_t port = options_.proxy ? options_.proxy->port : options_.url.port;
  ErrorCode no_literal;
  const auto address = asio::ip::make_address(host, no_literal);
  if (!no_literal) {  // without the resolver's thread
    endpoints_ = {Endpoint{address, port}};
    asio::post(io_, [self = shared_from_this()] { self->connect_next(); });
    return;
  }
  resolver_.async_resolve(host, std::to_string(port), asio::ip::tcp::resolver::numeric_service,
                          [self = shared_from_this(), host](ErrorCode error, const auto& results) {
                            if (!self->done_) return;
                            if (error) return self->fail(failure_text(error, nullptr, host));
                            for (const auto& result : results)
                              self->endpoints_.push_back(result.endpoint());
                            self->connect_next();
                          });
}

void Dialing::connect_next() {
  if (!done_) return;
  stage_ = "TCP connect";
  // Addresses take turns, and each try is short at first: a SYN that was lost in a cut is repeated
  // by the kernel only after 1, 3 and 7 seconds, and the link must be back soon after the network.
  const auto round = static_cast<int>(attempts_++ / endpoints_.size());
  const Endpoint endpoint = endpoints_.front();
  std::rotate(endpoints_.begin(), endpoints_.begin() + 1, endpoints_.end());
  socket_ = std::make_shared<WebSocket>(TcpSocket{io_.get_executor()});
  attempt_.expires_after(kFirstAttempt * (1 + round));
  attempt_.async_wait([weak = weak_from_this(), socket = std::weak_ptr{socket_}](ErrorCode error) {
    const auto self = weak.lock();
    const auto attempted = socket.lock();
    if (self && attempted && !error) attempted->next_layer().abort();
  });
  socket_->next_layer().socket().async_connect(
      endpoint, [self = shared_from_this(), endpoint](ErrorCode error) {
        self->on_connected(endpoint, error);
      });
}

void Dialing::on_connected(const Endpoint& endpoint, const ErrorCode& error) {
  if (!done_) return;
  attempt_.cancel();
  if (error == asio::error::operation_aborted) return connect_next();  // until the deadline
  if (error) {
    std::erase(endpoints_, endpoint);
    if (!endpoints_.empty()) return connect_next();
    return fail(failure_text(error, nullptr, {}));
  }
  tune_socket(socket_->next_layer().socket().native_handle(), sockets_);
  if (options_.proxy) return ask_proxy();
  enter();
}

void Dialing::ask_proxy() {
  stage_ = "CONNECT of the proxy";
  open_way(socket_, *options_.proxy, options_.url,
           [self = shared_from_this()](const std::string& problem) {
             if (!self->done_) return;
             if (!problem.empty()) return self->fail(problem);
             self->enter();
           });
}

void Dialing::enter() {
  if (options_.url.secure) return start_tls();
  upgrade();
}

std::string Dialing::server_name() const {
  return options_.tls.server_name.empty() ? options_.url.host : options_.tls.server_name;
}

void Dialing::start_tls() {
  stage_ = "TLS handshake";
  Transport& transport = socket_->next_layer();
  transport.start_tls(tls_);
  expect_server(transport.tls(), server_name(), options_.tls.verify);
  transport.async_tls_handshake(
      false, [self = shared_from_this()](ErrorCode error) { self->on_tls(error); });
}

void Dialing::on_tls(const ErrorCode& error) {
  if (!done_) return;
  SSL* const tls = socket_->next_layer().tls();
  if (error) return fail("TLS: " + failure_text(error, tls, server_name()));
  // Before the first byte of ours.
  const std::string problem = pin_problem(tls, options_.tls.pins);
  if (!problem.empty()) return fail("TLS: " + problem);
  upgrade();
}

void Dialing::upgrade() {
  stage_ = "WebSocket handshake";
  socket_->set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
    request.set(http::field::user_agent, "ROS2 Connect");
    request.set(http::field::sec_websocket_protocol, kSubprotocol);
  }));
  socket_->async_handshake(response_->http, options_.url.authority(), options_.url.path,
                           [self = shared_from_this()](ErrorCode error) {
                             if (self->done_) self->on_upgraded(error);
                           });
}

void Dialing::on_upgraded(const ErrorCode& error) {
  if (error) return fail(upgrade_problem(error));
  const auto subprotocol = response_->http[http::field::sec_websocket_protocol];
  if (subprotocol != kSubprotocol) {
    return fail("the server there speaks WebSocket, but not the subprotocol " +
                std::string{kSubprotocol} + " (is it a ROS2 Connect server?)");
  }
  finish(std::move(socket_), {});
}

std::string Dialing::upgrade_problem(const ErrorCode& error) const {
  const auto& response = response_->http;
  if (error == websocket::error::upgrade_declined) {
    const auto reason = http::obsolete_reason(response.result());
    const std::string body = first_line(response.body());
    return "HTTP " + std::to_string(response.result_int()) + " " +
           std::string{reason.data(), reason.size()} + (body.empty() ? "" : ": " + body);
  }
  if (error == http::error::end_of_stream || error == http::error::partial_message) {
    return "the other end ended the connection instead of answering the WebSocket handshake";
  }
  if (error.category() == make_error_code(http::error::bad_version).category()) {
    return "what answers there is no HTTP server (" + error.message() +
           "); is it a TLS port (wss://)?";
  }
  if (error.category() == make_error_code(websocket::error::closed).category()) {
    return "the answer to the WebSocket handshake is wrong: " + error.message();
  }
  return failure_text(error, socket_->next_layer().tls(), server_name());
}

void Dialing::cancel(std::string problem) {
  asio::post(io_,
             [self = shared_from_this(), problem = std::move(problem)] { self->fail(problem); });
}

void Dialing::fail(const std::string& problem) {
  if (!done_) return;
  if (socket_) socket_->next_layer().abort();
  const std::string by = options_.proxy ? " by the proxy " + proxy_text(*options_.proxy) : "";
  finish(nullptr, "cannot connect to " + options_.url.text() + by + ": " + problem);
}

void Dialing::finish(std::shared_ptr<WebSocket> socket, std::string problem) {
  deadline_.cancel();
  attempt_.cancel();
  resolver_.cancel();
  const Done done = std::move(done_);
  done_ = nullptr;
  done(std::move(socket), std::move(problem));
}

void Dialing::abandon() {
  done_ = nullptr;
  deadline_.cancel();
  attempt_.cancel();
  resolver_.cancel();
  if (socket_) socket_->next_layer().abort();
}

}  // namespace connect_bridge
