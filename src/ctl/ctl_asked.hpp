// A question to the status of a running side.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <iosfwd>
#include <string>

#include "core/base/json.hpp"

// The answer to one question, of which reading goes on. Whoever answers gives no more than is kept
// of it here.
class Asked {
 public:
  // `where`: "127.0.0.1:9091", or the file of a socket, with a slash.
  Asked(const std::string& where, const std::string& path);

  // Why there is no answer, for people; empty: there is one.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  // All of it.
  [[nodiscard]] std::string rest();
  // Of a stream of events. Null: there is none.
  [[nodiscard]] connect_bridge::Json next_event();

 private:
  std::iostream& stream();
  // Without its end; false: there is none, or it is longer than anybody says.
  bool line(std::string& text);

  boost::asio::local::stream_protocol::iostream file_;
  boost::asio::ip::tcp::iostream tcp_;
  const bool is_file_;
  std::string problem_;
};
