#include "access/plugins/https.hpp"

#include <algorithm>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <charconv>
#include <cstdlib>
#include <memory>
#include <string_view>

#include "config/http_proxy.hpp"
#include "net/tls/tls.hpp"
#include "net/tls/way.hpp"

namespace connect_bridge {
namespace {

namespace beast = boost::beast;
namespace http = boost::beast::http;

constexpr std::uint32_t kAnswerHeaderBytesMax = 16 << 10;
constexpr int kHttp11 = 11;

// The number in "public, max-age=600" (RFC 9111 section 5.2.2.1).
std::optional<std::chrono::seconds> max_age_of(std::string_view control) {
  constexpr std::string_view kName = "max-age=";
  const auto at = control.find(kName);
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view number = control.substr(at + kName.size());
  std::uint32_t seconds = 0;
  if (std::from_chars(number.data(), number.data() + number.size(), seconds).ec != std::errc{})
    return std::nullopt;
  return std::chrono::seconds(seconds);
}

// One request, on an io_context of its own.
class Exchange {
 public:
  Exchange(const HttpRequest& request, const std::optional<HttpProxy>& proxy, TlsContext tls)
      : request_(request),
        tls_(std::move(tls)),
        deadline_(io_),
        way_(std::make_shared<Way>(io_, request.url.host, request.url.port, proxy)) {}
  ~Exchange() { way_->stop(); }
  Exchange(const Exchange&) = delete;
  Exchange& operator=(const Exchange&) = delete;

  HttpAnswer run() {
    deadline_.expires_after(request_.timeout);
    deadline_.async_wait([this](ErrorCode) { fail("no answer in time"); });
    way_->start([this](auto socket, const Failure& why) {
      if (!socket) return fail(why.text);
      on_connected(std::move(*socket));
    });
    io_.run();
    return std::move(answer_);
  }

 private:
  void on_connected(TcpSocket socket) {
    transport_.emplace(std::move(socket));
    if (!request_.url.secure) return send();
    transport_->start_tls(tls_);
    expect_server(transport_->tls(), request_.url.host);  // mutant: https_name
    transport_->async_tls_handshake(false, [this](ErrorCode failed) {
      if (!failed) return send();
      fail("TLS: " + failure_of(failed, transport_->tls(), request_.url.host).text);
    });
  }

  void send() {
    const bool posts = !request_.json.empty();
    asked_.method(posts ? http::verb::post : http::verb::get);
    asked_.target(request_.url.target);
    asked_.version(kHttp11);
    asked_.set(http::field::host, request_.url.authority());
    asked_.set(http::field::user_agent, "ROS2 Connect");
    asked_.set(http::field::accept, "application/json");
    asked_.keep_alive(false);
    if (posts) {
      asked_.set(http::field::content_type, "application/json");
      asked_.body() = request_.json;
    }
    asked_.prepare_payload();
    http::async_write(*transport_, asked_, [this](ErrorCode error, std::size_t) {
      if (error) return fail(failure_of(error, transport_->tls(), request_.url.host).text);
      receive();
    });
  }

  void receive() {
    parser_.body_limit(request_.answer_bytes_max);
    parser_.header_limit(kAnswerHeaderBytesMax);
    transport_->stop_at_header_end();
    http::async_read(*transport_, buffer_, parser_, [this](ErrorCode error, std::size_t) {
      if (error == http::error::body_limit) return fail("the answer is too large");
      if (error) return fail(failure_of(error, transport_->tls(), request_.url.host).text);
      const auto& got = parser_.get();
      answer_.status = static_cast<int>(got.result_int());
      answer_.body = got.body();
      const auto control = got[http::field::cache_control];
      answer_.max_age = max_age_of({control.data(), control.size()});
      io_.stop();
    });
  }

  void fail(std::string problem) {
    if (answer_.problem.empty()) answer_.problem = std::move(problem);
    io_.stop();
  }

  const HttpRequest& request_;
  asio::io_context io_{1};
  TlsContext tls_;
  asio::steady_timer deadline_;
  const std::shared_ptr<Way> way_;
  std::optional<Transport> transport_;
  http::request<http::string_body> asked_;
  beast::flat_buffer buffer_;
  http::response_parser<http::string_body> parser_;
  HttpAnswer answer_;
};

}  // namespace

Https::Https(const std::string& ca_file, std::optional<HttpProxy> proxy)
    : files_({.ca_file = ca_file}, Role::kClient), proxy_(std::move(proxy)) {}

// The context stays between requests: reading the system's authorities takes milliseconds.
TlsContext Https::tls(std::string& problem) {
  const std::lock_guard lock(mutex_);
  return files_.get_fresh(problem);
}

HttpAnswer Https::fetch(const HttpRequest& request) {
  HttpAnswer answer;
  TlsContext context;
  if (request.url.secure) {
    context = tls(answer.problem);
    if (!context) return answer;
  }
  try {
    return Exchange(request, proxy_, std::move(context)).run();
  } catch (const std::exception& error) {
    answer.problem = error.what();
    return answer;
  }
}

HttpFetch https_fetch(const Url& address, const std::string& ca_file,
                      std::vector<std::string>& problems) {
  const auto variable = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string{value ? value : ""};
  };
  std::optional<HttpProxy> proxy;
  std::string wrong;
  if (address.secure) proxy = environment_proxy(address.host, address.port, variable, wrong);
  if (!wrong.empty()) problems.push_back("environment variable " + wrong + ": not a proxy's URL");
  return [https = std::make_shared<Https>(ca_file, std::move(proxy))](const HttpRequest& request) {
    return https->fetch(request);
  };
}

}  // namespace connect_bridge
