// From where on a value of the status is told to people: the same in the log, on /diagnostics and
// by `ctl doctor`.
#pragma once

#include <chrono>

#include "net/tls/certificate_end.hpp"

namespace connect_bridge {

inline constexpr double kLagMsWorthTelling = 500;     // of the loop
inline constexpr double kQueueMsWorthTelling = 1000;  // of the path
inline constexpr double kMemoryShareWorthTelling = 0.9;
// Left of a certificate.
inline constexpr int kCertificateDaysWorthTelling =
    static_cast<int>(CertificateEnd::kSoon / std::chrono::hours(24));

}  // namespace connect_bridge
