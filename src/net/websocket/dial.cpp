#include "net/websocket/dial.hpp"

#include <algorithm>
#include <boost/beast/http/field.hpp>
#include <boost/beast/http/status.hpp>
#include <boost/beast/websocket/error.hpp>

#include "core/wire/login.hpp"
#include "net/relay/relay_wire.hpp"
#include "net/tcp/socket_tuning.hpp"
#include "net/websocket/websocket.hpp"

namespace connect_bridge {
namespace {

constexpr char kHttpProtocol[] = "http/1.1";

// The first line of what a server or proxy answered, made harmless for a log.
std::string first_line(const std::string& body) {
  std::string line = body.substr(0, std::min<std::size_t>(body.find_first_of("\r\n"), 200));
  const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  line.erase(std::remove_if(line.begin(), line.end(), control), line.end());
  return line;
}

// A server with TLS that is asked in plain HTTP offers TLS in its answer (RFC 2817 section 4.2).
bool offers_tls(const websocket::response_type& response) {
  const auto offers = response[http::field::upgrade];
  return std::string_view{offers.data(), offers.size()}.starts_with("TLS/");
}

// Other programs answer something, but for some with TLS that are asked in plain HTTP.
Failure ended_at_once(bool secure) {
  return {
      Cause::kServerSilent,
      std::string{"it accepts the connection and ends it without a byte (does a forwarded port, "
                  "tunnel or balancer there reach no server?"} +
          (secure ? ")" : " Or is it a TLS port, for wss://?)")};
}

Cause cause_of_answer(const websocket::response_type& response) {
  if (offers_tls(response)) return Cause::kPlainToTlsPort;
  if (response.result_int() == 503 && response[http::field::server] == kProgramName)
    return Cause::kTooManyConnections;  // the server has no place at all
  switch (response.result_int()) {
    case 401:
    case 403: return Cause::kHttpLogin;
    case 404: return Cause::kPathWrong;
    case 501: return Cause::kProxyWithoutUpgrade;
    case 511: return Cause::kCaptivePortal;
    default: break;
  }
  switch (http::to_status_class(response.result())) {
    case http::status_class::client_error: return Cause::kProxyWithoutUpgrade;
    case http::status_class::server_error: return Cause::kProxyWithoutServer;
    case http::status_class::successful:
    case http::status_class::redirection: return Cause::kCaptivePortal;
    default: return Cause::kNotThisProgram;
  }
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
  way_->start([self = shared_from_this()](auto socket, const Failure& why) {
    if (!socket) return self->fail(why);
    self->on_connected(std::move(*socket));
  });
}

void Dialing::on_deadline() {
  was_silent_ = stage_ == nullptr;
  if (was_silent_) return fail(way_->silence());
  fail({Cause::kServerSilent, std::string{"no answer in time ("} + stage_ + ")"});
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
  if (!words_.empty()) {
    words_.insert(words_.begin(), kClientProtocol);
    // A proxy that ends TLS may refuse a list without a protocol that it knows (RFC 7301
    // section 3.2). A relay wants the kind of connection first, and answers nothing.
    if (options_.url.robot.empty()) words_.insert(words_.begin(), kHttpProtocol);
    const std::string list = protocol_list(words_);
    const ByteView offered = view_of(list);  // without an answer to it the handshake goes on
    SSL_set_alpn_protos(transport.tls(), offered.data(), static_cast<unsigned>(offered.size()));
  }
  transport.async_tls_handshake(
      false, [self = shared_from_this()](ErrorCode error) { self->on_tls(error); });
}

void Dialing::on_tls(const ErrorCode& error) {
  if (!done_) return;
  SSL* const tls = socket_->next_layer().tls();
  if (error) {
    const Failure why = failure_by(error);
    return fail({why.cause, "TLS: " + why.text});
  }
  // Checked before we send the first byte.
  const Failure other_key = pin_failure(tls, options_.tls.pins);
  if (other_key)  // mutant: pin
    return fail({other_key.cause,
                 options_.tls.pins_by_invitation
                     ? "this is not the server of the invitation (copy it whole, or let 'server "
                       "--pair' make another): " +
                           other_key.text
                     : "TLS: " + other_key.text});
  upgrade();
}

void Dialing::upgrade() {
  stage_ = "WebSocket handshake";
  socket_->next_layer().stop_at_header_end();
  socket_->set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
    request.set(http::field::user_agent, kProgramName);
    request.set(http::field::sec_websocket_protocol, kSubprotocol);
  }));
  socket_->async_handshake(response_->http, options_.url.authority(), options_.url.target,
                           [self = shared_from_this()](ErrorCode error) {
                             if (self->done_) self->on_upgraded(error);
                           });
}

void Dialing::on_upgraded(const ErrorCode& error) {
  if (error) return fail(upgrade_failure(error));
  const auto subprotocol = response_->http[http::field::sec_websocket_protocol];
  if (subprotocol != kSubprotocol) {
    return fail({Cause::kNotThisProgram,
                 "the server there speaks WebSocket, but not the subprotocol " +
                     std::string{kSubprotocol} + " (is it a ROS2 Connect server?)"});
  }
  finish(std::move(socket_), {});
}

Failure Dialing::upgrade_failure(const ErrorCode& error) const {
  const auto& response = response_->http;
  if (error == websocket::error::upgrade_declined) {
    const auto reason = http::obsolete_reason(response.result());
    const std::string body = first_line(response.body());
    const auto elsewhere = response[http::field::location];
    const std::string to = first_line(std::string{elsewhere.data(), elsewhere.size()});
    return {cause_of_answer(response), "HTTP " + std::to_string(response.result_int()) + " " +
                                           std::string{reason.data(), reason.size()} +
                                           (to.empty() ? "" : " to " + to) +
                                           (body.empty() ? "" : ": " + body)};
  }
  if (error == http::error::body_limit)
    return {Cause::kCaptivePortal,
            "the answer to the WebSocket handshake is too large (is it a ROS2 Connect server?)"};
  if (error == http::error::end_of_stream && heard_nothing())
    return ended_at_once(options_.url.secure);
  if (error == http::error::end_of_stream || error == http::error::partial_message)
    return {Cause::kNotThisProgram,
            "the other end ended the connection instead of answering the WebSocket handshake"};
  if (error.category() == make_error_code(http::error::bad_version).category())
    return {options_.url.secure ? Cause::kNotThisProgram : Cause::kPlainToTlsPort,
            "what answers there is not an HTTP server (" + error.message() +
                "); is it a TLS port (wss://)?"};
  if (error.category() == make_error_code(websocket::error::closed).category())
    return {Cause::kNotThisProgram,
            "the answer to the WebSocket handshake is wrong: " + error.message()};
  return failure_by(error);
}

bool Dialing::heard_nothing() const {
  Transport& transport = socket_->next_layer();
  SSL* const tls = transport.tls();
  return tls ? BIO_number_read(SSL_get_rbio(tls)) == 0 : transport.read_bytes() == 0;
}

// A peer that answers and closes the connection before it sends anything of our protocol is another
// program.
Failure Dialing::failure_by(const ErrorCode& error) const {
  Failure why = failure_of(error, socket_->next_layer().tls(), server_name(options_));
  if (why.cause == Cause::kConnectionLost && heard_nothing())
    return ended_at_once(options_.url.secure);
  if (why.cause == Cause::kConnectionLost) why.cause = Cause::kNotThisProgram;
  const std::string& robot = options_.url.robot;
  if (why.cause == Cause::kNameNotServed && !robot.empty())
    return {Cause::kRobotNotAtRelay, "no '" + robot + "' is connected to the relay there"};
  return why;
}

void Dialing::cancel(Failure why) {
  asio::post(io_, [self = shared_from_this(), why = std::move(why)] { self->fail(why); });
}

// The kernel has no counts of a socket that was aborted.
void Dialing::abort() {
  if (!socket_) return;
  traffic_ = traffic_of(socket_->next_layer().socket().native_handle());  // mutant: failed_dials
  socket_->next_layer().abort();
}

void Dialing::fail(const Failure& why) {
  if (!done_) return;
  abort();
  const auto& proxy = options_.proxy;
  std::string by = proxy ? " by the proxy " + host_and_port(proxy->host, proxy->port) : "";
  by += way_->led_to();
  if (proxy && !proxy->variable.empty()) by += " (" + proxy->variable + " of the environment)";
  const bool is_relay = !proxy && !options_.url.robot.empty();
  const bool is_unreachable = why.cause == Cause::kPortClosed || why.cause == Cause::kNoAnswer;
  finish(nullptr, {is_relay && is_unreachable ? Cause::kRelayUnreachable : why.cause,
                   options_.url.text("ws") + by + ": " + why.text});
}

void Dialing::finish(std::shared_ptr<WebSocket> socket, Failure why) {
  deadline_.cancel();
  way_->stop();
  const Done done = std::move(done_);
  done_ = nullptr;
  done(std::move(socket), std::move(why));
}

void Dialing::abandon() {
  done_ = nullptr;
  deadline_.cancel();
  way_->stop();
  abort();
}

}  // namespace connect_bridge
