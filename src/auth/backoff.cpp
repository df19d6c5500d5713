#include "auth/backoff.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <array>

namespace connect_bridge {

std::string network_of(std::string_view peer) {
  const auto colon = peer.rfind(':');
  if (peer.empty() || peer.front() != '[') return std::string{peer.substr(0, colon)};
  std::string address{peer.substr(1, peer.find(']') - 1)};
  address.resize(std::min(address.size(), address.find('%')));  // fe80::1%eth0
  in6_addr bytes{};
  if (::inet_pton(AF_INET6, address.c_str(), &bytes) != 1) return address;
  std::fill(std::begin(bytes.s6_addr) + 8, std::end(bytes.s6_addr), std::uint8_t{0});
  std::array<char, INET6_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET6, &bytes, text.data(), text.size());
  return text.data();
}

double Backoff::places(const Bucket& bucket, TimePoint now) const {
  const double seconds = std::chrono::duration<double>(now - bucket.updated).count();
  return std::min(options_.failures_max,
                  bucket.places + std::max(0.0, seconds) * options_.failures_per_second);
}

bool Backoff::take(const std::string& peer, TimePoint now) {
  const std::string network = network_of(peer);
  auto found = buckets_.find(network);
  if (found == buckets_.end()) {
    make_room(now);
    found = buckets_.emplace(network, Bucket{options_.failures_max, now}).first;
  }
  Bucket& bucket = found->second;
  bucket = {places(bucket, now), now};
  if (bucket.places < 1) return false;
  bucket.places -= 1;
  return true;
}

void Backoff::give_back(const std::string& peer, TimePoint now) {
  const auto found = buckets_.find(network_of(peer));
  if (found == buckets_.end()) return;
  Bucket& bucket = found->second;
  bucket = {std::min(options_.failures_max, places(bucket, now) + 1), now};
  if (bucket.places >= options_.failures_max) buckets_.erase(found);
}

void Backoff::make_room(TimePoint now) {
  if (buckets_.size() < options_.addresses_max) return;
  for (auto it = buckets_.begin(); it != buckets_.end();) {
    it = places(it->second, now) >= options_.failures_max ? buckets_.erase(it) : std::next(it);
  }
  while (!buckets_.empty() && buckets_.size() >= options_.addresses_max) {
    buckets_.erase(
        std::max_element(buckets_.begin(), buckets_.end(), [&](const auto& one, const auto& other) {
          return places(one.second, now) < places(other.second, now);
        }));
  }
}

}  // namespace connect_bridge
