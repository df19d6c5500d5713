#include "net/way.hpp"

#include "net/http_proxy.hpp"
#include "net/tls.hpp"

namespace connect_bridge {

Way::Way(asio::io_context& io, std::string host, std::uint16_t port, std::optional<HttpProxy> proxy,
         bool slow)
    : host_(std::move(host)),
      port_(port),
      proxy_(std::move(proxy)),
      look_up_(io),
      race_(std::make_shared<Race>(io, slow)) {}

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
        if (error) return self->finish({}, failure_text(error, nullptr, host));
        self->race(found);
      });
}

void Way::race(const std::vector<Race::Endpoint>& addresses) {
  stage_ = "TCP connect";
  tried_ = addresses.front().address();
  race_->start(addresses, [self = shared_from_this()](auto socket, const ErrorCode& error) {
    if (!socket) return self->finish({}, failure_text(error, nullptr, {}));
    if (self->proxy_) return self->ask_proxy(std::move(*socket));
    self->finish(std::move(socket), {});
  });
}

void Way::ask_proxy(TcpSocket socket) {
  stage_ = "CONNECT of the proxy";
  asking_ = std::make_shared<TcpSocket>(std::move(socket));
  open_way(asking_, *proxy_, host_, port_, [self = shared_from_this()](const std::string& problem) {
    if (!self->done_) return;
    if (!problem.empty()) return self->finish({}, problem);
    self->finish(std::move(*self->asking_), {});
  });
}

void Way::finish(std::optional<TcpSocket> socket, const std::string& problem) {
  const Done done = std::move(done_);
  stop();
  done(std::move(socket), problem);
}

void Way::stop() {
  done_ = nullptr;
  look_up_.stop();
  race_->stop();
  ErrorCode ignored;
  if (asking_) asking_->close(ignored);
}

}  // namespace connect_bridge
