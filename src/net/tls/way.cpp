#include "net/tls/way.hpp"

#include <algorithm>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/status.hpp>
#include <set>

#include "core/base/base64.hpp"
#include "net/tls/tls.hpp"

namespace connect_bridge {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;

constexpr std::size_t kAnswerBytesMax = 8192;

std::string connect_text(const HttpProxy& proxy, const std::string& target) {
  std::string text =
      "CONNECT " + target + " HTTP/1.1\r\nHost: " + target + "\r\nUser-Agent: ROS2 Connect\r\n";
  if (!proxy.login.empty())
    text += "Proxy-Authorization: Basic " + to_base64(view_of(proxy.login)) + "\r\n";
  return text + "\r\n";
}

// Why the proxy gives no way with this answer; nothing: it does.
Failure refusal_in(const http::response<http::empty_body>& answer, const HttpProxy& proxy) {
  const auto status = answer.result();
  if (http::to_status_class(status) == http::status_class::successful) return {};
  if (status == http::status::proxy_authentication_required)
    return {Cause::kProxyLogin,
            (proxy.login.empty() ? "it wants a login (" : "it refuses this login (") +
                proxy.login_key + ")"};
  const auto reason = http::obsolete_reason(status);
  return {Cause::kProxyRefuses, "it refuses CONNECT with HTTP " +
                                    std::to_string(answer.result_int()) + " " +
                                    std::string{reason.data(), reason.size()}};
}

// Sorted: name servers rotate the addresses, and the same reason is logged once.
std::string addresses_text(const std::string& name, const std::vector<Race::Endpoint>& found) {
  constexpr std::size_t kShown = 3;
  std::set<asio::ip::address> all;
  for (const Race::Endpoint& one : found) all.insert(one.address());
  const bool is_here = name != "localhost" &&
                       std::all_of(all.begin(), all.end(),
                                   [](const asio::ip::address& one) { return one.is_loopback(); });
  std::string text;
  std::size_t shown = 0;
  for (const asio::ip::address& one : all)
    if (shown++ < kShown) text += (text.empty() ? " (" : ", ") + one.to_string();
  if (shown > kShown) text += " and " + std::to_string(shown - kShown) + " more";
  return text + (is_here ? ", this machine itself)" : ")");
}

}  // namespace

// The connection to the proxy, during CONNECT.
struct Way::Asking {
  TcpSocket socket;
  std::string request;
  beast::flat_buffer buffer{kAnswerBytesMax};
  http::response_parser<http::empty_body> answer{};
};

Way::Way(asio::io_context& io, std::string host, std::uint16_t port, std::optional<HttpProxy> proxy,
         bool slow)
    : host_(std::move(host)),
      port_(port),
      proxy_(std::move(proxy)),
      look_up_(io),
      race_(std::make_shared<Race>(io, slow)) {}

Way::~Way() = default;

void Way::start(Done done) {
  done_ = std::move(done);
  const std::string& host = proxy_ ? proxy_->host : host_;
  const std::uint16_t port = proxy_ ? proxy_->port : port_;
  ErrorCode no_literal;
  const auto address = asio::ip::make_address(host, no_literal);
  if (!no_literal) return race({{address, port}});  // without a thread
  look_up_.start(
      host, port,
      [weak = weak_from_this(), host](const ErrorCode& error, const LookUp::Endpoints& found) {
        const auto self = weak.lock();
        if (!self || !self->done_) return;
        if (error) return self->finish({}, self->failure_by(error, host));
        self->led_to_ = addresses_text(host, found);
        self->race(found);
      });
}

void Way::race(const std::vector<Race::Endpoint>& addresses) {
  silence_ = {Cause::kNoAnswer, "TCP connect"};
  tried_ = addresses.front().address();
  race_->start(addresses, [self = shared_from_this()](auto socket, const ErrorCode& error) {
    if (!socket) return self->finish({}, self->failure_by(error, {}));
    self->note_answer(*socket);
    if (self->proxy_) return self->ask_proxy(std::move(*socket));
    self->finish(std::move(socket), {});
  });
}

// The address of several that what follows concerns.
void Way::note_answer(const TcpSocket& socket) {
  ErrorCode gone;
  const auto answered = socket.remote_endpoint(gone);
  if (!gone && !led_to_.empty())
    led_to_ = addresses_text(proxy_ ? proxy_->host : host_, {answered});
}

void Way::ask_proxy(TcpSocket socket) {
  silence_ = {Cause::kProxySilent, "CONNECT of the proxy"};
  asking_.reset(new Asking{std::move(socket), connect_text(*proxy_, host_and_port(host_, port_))});
  asking_->answer.header_limit(kAnswerBytesMax);
  asking_->answer.skip(true);  // no body follows, whatever the header says
  asio::async_write(
      asking_->socket, asio::buffer(asking_->request),
      [self = shared_from_this()](ErrorCode error, std::size_t) { self->on_asked(error); });
}

void Way::on_asked(const ErrorCode& error) {
  if (!done_) return;
  if (error) return finish({}, failure_by(error, {}));
  http::async_read_header(
      asking_->socket, asking_->buffer, asking_->answer,
      [self = shared_from_this()](ErrorCode wrong, std::size_t) { self->on_answered(wrong); });
}

void Way::on_answered(const ErrorCode& error) {
  if (!done_) return;
  if (error == http::error::end_of_stream || error == http::error::partial_message)
    return finish({}, {Cause::kProxyRefuses, "it ended the connection instead of answering"});
  if (error.category() == make_error_code(http::error::bad_version).category())
    return finish({}, {Cause::kProxyRefuses,
                       "what answers there is not an HTTP proxy (" + error.message() + ")"});
  if (error) return finish({}, failure_by(error, {}));
  if (const Failure refusal = refusal_in(asking_->answer.get(), *proxy_))
    return finish({}, refusal);
  // Neither TLS nor HTTP servers speak first.
  if (asking_->buffer.size() > 0)
    return finish({}, {Cause::kProxyRefuses, "it sent more than its answer"});
  finish(std::move(asking_->socket), {});
}

Failure Way::silence() const {
  const bool before_proxy = proxy_ && silence_.cause != Cause::kProxySilent;
  return {before_proxy ? Cause::kProxyUnreachable : silence_.cause,
          "no answer in time (" + silence_.text + ")"};
}

Failure Way::failure_by(const ErrorCode& error, const std::string& name) const {
  Failure why = failure_of(error, nullptr, name);
  if (proxy_) why.cause = Cause::kProxyUnreachable;
  return why;
}

void Way::finish(std::optional<TcpSocket> socket, const Failure& why) {
  const Done done = std::move(done_);
  stop();
  done(std::move(socket), why);
}

void Way::stop() {
  done_ = nullptr;
  look_up_.stop();
  race_->stop();
  ErrorCode ignored;
  if (asking_) asking_->socket.close(ignored);
}

}  // namespace connect_bridge
