#include "ctl/ctl_asked.hpp"

#include <chrono>
#include <istream>
#include <string_view>

#include "config/syntax.hpp"
#include "core/wire/text.hpp"
#include "ctl/status_text.hpp"

namespace {

constexpr auto kAnswerTime = std::chrono::seconds(10);
// One byte more than a status may have, so that a cut answer is not taken for one.
constexpr std::size_t kAnswerBytesMax = connect_bridge::kStatusBytesMax + 1;
constexpr std::size_t kProblemBytesMax = 200;

}  // namespace

Asked::Asked(const std::string& where, const std::string& path)
    : is_file_(where.find('/') != std::string::npos) {
  if (is_file_) {
    file_.expires_after(kAnswerTime);
    file_.connect(boost::asio::local::stream_protocol::endpoint(where));
  } else {
    const auto at = connect_bridge::syntax::parse_status_address(where);
    tcp_.expires_after(kAnswerTime);
    tcp_.connect(at->host, std::to_string(at->port));
  }
  stream() << "GET " << path << " HTTP/1.1\r\nHost: localhost\r\n\r\n" << std::flush;
  std::string text;
  if (!line(text) || text.empty()) {
    problem_ = "nobody answers";
  } else if (text.rfind("HTTP/1.1 200", 0) != 0) {
    problem_ = connect_bridge::to_text(text.substr(0, text.find('\r')), kProblemBytesMax);
  }
  while (line(text) && text != "\r") {
  }
}

std::iostream& Asked::stream() {
  if (is_file_) return file_;
  return tcp_;
}

bool Asked::line(std::string& text) {
  text.clear();
  for (char c = 0; text.size() < kAnswerBytesMax && stream().get(c);) {
    if (c == '\n') return true;
    text += c;
  }
  return false;
}

std::string Asked::rest() {
  std::string all;
  for (char c = 0; all.size() < kAnswerBytesMax && stream().get(c);) all += c;
  return all;
}

connect_bridge::Json Asked::next_event() {
  file_.expires_after(kAnswerTime);
  tcp_.expires_after(kAnswerTime);
  constexpr std::string_view kData = "data: ";
  std::string text;
  while (line(text))
    if (text.rfind(kData, 0) == 0)
      return connect_bridge::read_status(std::string_view(text).substr(kData.size()));
  return nullptr;
}
