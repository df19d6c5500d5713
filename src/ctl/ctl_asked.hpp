// One request for the status of a running side.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <iosfwd>
#include <string>

#include "core/base/json.hpp"

// The answer to one request, which is read piece by piece. A limit bounds the bytes that are kept
// of it.
class Asked {
 public:
  // `where`: "127.0.0.1:9091", or a socket file with a slash in its name.
  Asked(const std::string& where, const std::string& path);

  // Reason why there is no answer, for people; empty: there is one.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  // The rest of the answer, up to kStatusBytesMax + 1 bytes.
  [[nodiscard]] std::string rest();
  // The next event of a stream. Null: there is none within 10 s.
  [[nodiscard]] connect_bridge::Json next_event();

 private:
  std::iostream& stream();
  // Reads a line without its end; false: there is none, or it is longer than the limit.
  bool line(std::string& text);

  boost::asio::local::stream_protocol::iostream file_;
  boost::asio::ip::tcp::iostream tcp_;
  const bool is_file_;
  std::string problem_;
};
