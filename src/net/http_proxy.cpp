#include "net/http_proxy.hpp"

#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/status.hpp>

#include "core/base/base64.hpp"
#include "net/tls.hpp"

namespace connect_bridge {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;

constexpr std::size_t kAnswerBytesMax = 8192;

struct Asking {
  std::shared_ptr<TcpSocket> socket;
  HttpProxy proxy;
  std::string request;
  beast::flat_buffer buffer{kAnswerBytesMax};
  http::response_parser<http::empty_body> answer;
  std::function<void(std::string)> done;
};

std::string request_text(const HttpProxy& proxy, const std::string& target) {
  std::string text =
      "CONNECT " + target + " HTTP/1.1\r\nHost: " + target + "\r\nUser-Agent: ROS2 Connect\r\n";
  if (!proxy.login.empty())
    text += "Proxy-Authorization: Basic " + to_base64(view_of(proxy.login)) + "\r\n";
  return text + "\r\n";
}

std::string refusal(const Asking& asking) {
  const auto status = asking.answer.get().result();
  if (status == http::status::proxy_authentication_required)
    return (asking.proxy.login.empty() ? "it wants a login (" : "it refuses this login (") +
           asking.proxy.login_key + ")";
  const auto reason = http::obsolete_reason(status);
  return "it refuses CONNECT with HTTP " + std::to_string(asking.answer.get().result_int()) + " " +
         std::string{reason.data(), reason.size()};
}

std::string problem_of(const Asking& asking, const ErrorCode& error) {
  if (error == http::error::end_of_stream || error == http::error::partial_message)
    return "it ended the connection instead of answering";
  if (error.category() == make_error_code(http::error::bad_version).category())
    return "what answers there is not an HTTP proxy (" + error.message() + ")";
  if (error) return failure_text(error, nullptr, {});
  if (http::to_status_class(asking.answer.get().result()) != http::status_class::successful)
    return refusal(asking);
  // Neither TLS nor HTTP servers speak first.
  if (asking.buffer.size() > 0) return "it sent more than its answer";
  return {};
}

void read_answer(const std::shared_ptr<Asking>& asking) {
  http::async_read_header(
      *asking->socket, asking->buffer, asking->answer,
      [asking](ErrorCode error, std::size_t) { asking->done(problem_of(*asking, error)); });
}

}  // namespace

void open_way(std::shared_ptr<TcpSocket> socket, const HttpProxy& proxy, const std::string& host,
              std::uint16_t port, std::function<void(std::string)> done) {
  const auto asking = std::make_shared<Asking>();
  asking->socket = std::move(socket);
  asking->proxy = proxy;
  asking->request = request_text(proxy, host_and_port(host, port));
  asking->done = std::move(done);
  asking->answer.header_limit(kAnswerBytesMax);
  asking->answer.skip(true);  // no body follows, whatever the header says
  asio::async_write(*asking->socket, asio::buffer(asking->request),
                    [asking](ErrorCode error, std::size_t) {
                      if (error) return asking->done(failure_text(error, nullptr, {}));
                      read_answer(asking);
                    });
}

}  // namespace connect_bridge
