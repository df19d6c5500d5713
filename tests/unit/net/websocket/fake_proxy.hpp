// An HTTP proxy on the loopback, for one connection.
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <string>

#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {

namespace asio = boost::asio;
using asio::ip::tcp;

inline constexpr char kDone[] = "HTTP/1.1 200 Connection established\r\n\r\n";

// Answers a request with a text, then carries bytes to and from a server, if it has one.
class FakeProxy {
 public:
  FakeProxy(Loop& loop, std::string answer, std::uint16_t server = 0)
      : near_(loop.io), far_(loop.io), answer_(std::move(answer)), server_(server) {
    acceptor_.async_accept(near_, [this](auto error) {
      if (!error) read_request();
    });
  }

  [[nodiscard]] HttpProxy proxy(const std::string& login = "") const {
    return {"127.0.0.1", acceptor_.local_endpoint().port(), login};
  }
  std::string request;

 private:
  void read_request() {
    near_.async_read_some(asio::buffer(up_), [this](auto error, std::size_t bytes) {
      if (error) return;
      request.append(up_.data(), bytes);
      if (request.find("\r\n\r\n") == std::string::npos) return read_request();
      asio::write(near_, asio::buffer(answer_));
      if (server_ == 0) return near_.close();
      far_.connect({asio::ip::address_v4::loopback(), server_});
      carry(near_, far_, up_);
      carry(far_, near_, down_);
    });
  }
  void carry(tcp::socket& from, tcp::socket& to, std::array<char, 4096>& buffer) {
    from.async_read_some(asio::buffer(buffer), [&, this](auto error, std::size_t bytes) {
      if (error) return;
      asio::write(to, asio::buffer(buffer.data(), bytes));
      carry(from, to, buffer);
    });
  }

  tcp::socket near_, far_;
  tcp::acceptor acceptor_{near_.get_executor(), {asio::ip::address_v4::loopback(), 0}};
  std::string answer_;
  std::uint16_t server_;
  std::array<char, 4096> up_{}, down_{};
};

}  // namespace connect_bridge::test
