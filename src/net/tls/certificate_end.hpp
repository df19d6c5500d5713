// The end of a side's own certificate, or of one that vouches for it, told in time at the machine
// where they can be replaced.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "core/base/time.hpp"
#include "net/tcp/transport.hpp"

namespace connect_bridge {

// Peers refuse a certificate that has ended, and mostly also if one of its chain has, and nobody at
// the robot sees that. Thread: the loop's.
class CertificateEnd {
 public:
  static constexpr Duration kSoon = std::chrono::hours(30 * 24);
  static constexpr Duration kPeriod = std::chrono::hours(24);

  CertificateEnd() = default;  // no certificate is shown
  // `name`: whose it is, empty if it has none; `end` as in end(); `above`: the subject of the one
  // in its chain that ends first, empty if that is the certificate itself.
  CertificateEnd(std::string name, Stamp end, std::string above = {})
      : name_(std::move(name)), above_(std::move(above)), end_(end) {}

  // When the first of the chain ends. 0: never.
  [[nodiscard]] Stamp end() const { return end_; }
  // Whether the certificate itself has ended: where one of its chain has, a peer may know another
  // way to an authority.
  [[nodiscard]] bool is_over(Stamp now) const { return above_.empty() && end_ != 0 && end_ <= now; }
  // The line for the log, once a day while it has ended or soon will. To be called once a second.
  [[nodiscard]] std::optional<std::string> take_line(const Now& now);

 private:
  std::string name_;
  std::string above_;
  Stamp end_ = 0;
  std::optional<TimePoint> next_;
};

// The first end of validity in the chain that this context shows: its certificate and the others.
[[nodiscard]] CertificateEnd end_of_certificate(asio::ssl::context& context);

}  // namespace connect_bridge
