// The end of a side's own certificate, told in time at the machine where it can be replaced.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "core/base/time.hpp"
#include "net/transport.hpp"

namespace connect_bridge {

// Peers refuse a certificate that has ended, and nobody at the robot sees that. Thread: the loop's.
class CertificateEnd {
 public:
  static constexpr Duration kSoon = std::chrono::hours(30 * 24);
  static constexpr Duration kPeriod = std::chrono::hours(24);

  CertificateEnd() = default;  // no certificate is shown
  // `name`: whose it is, empty if it has none; `end` as in end().
  CertificateEnd(std::string name, Stamp end) : name_(std::move(name)), end_(end) {}

  // 0: never.
  [[nodiscard]] Stamp end() const { return end_; }
  // The line for the log, once a day while it has ended or soon will. To be called once a second.
  [[nodiscard]] std::optional<std::string> take_line(const Now& now);

 private:
  std::string name_;
  Stamp end_ = 0;
  std::optional<TimePoint> next_;
};

// Of the certificate that is shown with this context.
[[nodiscard]] CertificateEnd end_of_certificate(asio::ssl::context& context);

}  // namespace connect_bridge
