#include "net/websocket/dial.hpp"

#include <algorithm>
#include <boost/beast/http/field.hpp>
#include <boost/beast/http/status.hpp>
#include <boost/beast/websocket/error.hpp>

#include "core/wire/login.hpp"
#include "net/tcp/socket_tuning.hpp"
#include "net/websocket/websocket.hpp"

namespace connect_bridge {
namespace {

// The first line of what a server or proxy answered, made harmless for a log.
std::string first_line(const std::string& body) {
  std::string line = body.substr(0, std::min<std::size_t>(body.find_first_of("\r\n"), 200));
  const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  line.erase(std::remove_if(line.begin(), line.end(), control), line.end());
  return line;
}

}  // namespace

std::string server_name(const DialOptions& options) {
  if (!options.url.robot.empty()) return options.url.robot;  // mutant: name_through_a_relay
  return options.url.host;
}

struct Dialing::Response {
  websocket::response_type http;
};

Dialing::Dialing(asio::io_context& io, DialOptions options, SocketOptions sockets, TlsContext tls)
    : io_(io),
      options_(std::move(options)),
      sockets_(std::move(sockets)),
      deadline_(io),
      way_(std::make_shared<Way>(io, options_.url.host, options_.url.port, options_.proxy,
                                 options_.slow)),
      tls_(std::move(tls)),
      response_(std::make_unique<Response>()) {}

Dialing::~Dialing() = default;

void Dialing::start(Done done) {
  done_ = std::move(done);
  call_after(deadline_, options_.timeout, if_alive(this, &Dialing::on_deadline));
  if (options_.url.secure && !tls_) return;
  way_->start([self = shared_from_this()](auto socket, const std::string& problem) {
    if (!socket) return self->fail(problem);
    self->on_connected(std::move(*socket));
  });
}

void Dialing::on_deadline() {
  was_silent_ = !answered();
  fail(std::string{"no answer in time ("} + (stage_ ? stage_ : way_->stage()) + ")");
}

void Dialing::on_connected(TcpSocket socket) {
  tune_socket(socket.native_handle(), sockets_);
  socket_ = std::make_shared<WebSocket>(std::move(socket));
  if (options_.url.secure) return start_tls();
  upgrade();
}

void Dialing::start_tls() {
  stage_ = "TLS handshake";
  Transport& transport = socket_->next_layer();
  transport.start_tls(tls_);
  expect_server(transport.tls(), server_name(options_));  // mutant: server_name
  transport.async_tls_handshake(
      false, [self = shared_from_this()](ErrorCode error) { self->on_tls(error); });
}

void Dialing::on_tls(const ErrorCode& error) {
  if (!done_) return;
  SSL* const tls = socket_->next_layer().tls();
  if (error) return fail("TLS: " + failure_text(error, tls, server_name(options_)));
  // Checked before we send the first byte.
  const std::string problem = pin_problem(tls, options_.tls.pins);
  met_other_key_ = !problem.empty();
  if (!problem.empty())  // mutant: pin
    return fail(
        (options_.tls.pins_by_invitation ? "this is not the server of the invitation: " : "TLS: ") +
        problem);
  upgrade();
}

void Dialing::upgrade() {
  stage_ = "WebSocket handshake";
  socket_->next_layer().stop_at_header_end();
  socket_->set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
    request.set(http::field::user_agent, "ROS2 Connect");
    request.set(http::field::sec_websocket_protocol, kSubprotocol);
  }));
  socket_->async_handshake(response_->http, options_.url.authority(), options_.url.target,
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
  if (error == http::error::body_limit)
    return "the answer to the WebSocket handshake is too large (is it a ROS2 Connect server?)";
  if (error == http::error::end_of_stream || error == http::error::partial_message) {
    return "the other end ended the connection instead of answering the WebSocket handshake";
  }
  if (error.category() == make_error_code(http::error::bad_version).category()) {
    return "what answers there is not an HTTP server (" + error.message() +
           "); is it a TLS port (wss://)?";
  }
  if (error.category() == make_error_code(websocket::error::closed).category()) {
    return "the answer to the WebSocket handshake is wrong: " + error.message();
  }
  return failure_text(error, socket_->next_layer().tls(), server_name(options_));
}

void Dialing::cancel(std::string problem) {
  asio::post(io_,
             [self = shared_from_this(), problem = std::move(problem)] { self->fail(problem); });
}

void Dialing::fail(const std::string& problem) {
  if (!done_) return;
  if (socket_) socket_->next_layer().abort();
  const auto& proxy = options_.proxy;
  const std::string by = proxy ? " by the proxy " + host_and_port(proxy->host, proxy->port) : "";
  finish(nullptr, options_.url.text("ws") + by + ": " + problem);
}

void Dialing::finish(std::shared_ptr<WebSocket> socket, std::string problem) {
  deadline_.cancel();
  way_->stop();
  const Done done = std::move(done_);
  done_ = nullptr;
  done(std::move(socket), std::move(problem));
}

void Dialing::abandon() {
  done_ = nullptr;
  deadline_.cancel();
  way_->stop();
  if (socket_) socket_->next_layer().abort();
}

}  // namespace connect_bridge
