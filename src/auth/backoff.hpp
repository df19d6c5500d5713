// Slows down guessing: an address may fail a few times, then once in a while.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <unordered_map>

#include "core/base/time.hpp"

namespace connect_bridge {

struct BackoffOptions {
  double failures_max = 5;         // in a row
  double failures_per_second = 1;  // after that
  std::size_t addresses_max = 4096;
};

// A token bucket per address; IPv6 addresses count by their /64. An attempt takes a place before it
// is checked, so that many at once do not slip through, and gives it back when it succeeds.
// At addresses_max the address that has failed least is forgotten.
class Backoff {
 public:
  explicit Backoff(const BackoffOptions& options) : options_(options) {}

  // `peer` is "203.0.113.5:51234" or "[2001:db8::1]:51234". False: this address has to wait.
  [[nodiscard]] bool take(const std::string& peer, TimePoint now);
  void give_back(const std::string& peer, TimePoint now);
  [[nodiscard]] std::size_t size() const { return buckets_.size(); }

 private:
  struct Bucket {
    double places = 0;
    TimePoint updated{};
  };

  [[nodiscard]] double places(const Bucket& bucket, TimePoint now) const;
  void make_room(TimePoint now);

  BackoffOptions options_;
  std::unordered_map<std::string, Bucket> buckets_;
};

// What the limits count: the IPv4 address, or the first 64 bits of the IPv6 address.
[[nodiscard]] std::string network_of(std::string_view peer);

}  // namespace connect_bridge
