// One number for all that the sides of a world do: every action and every packet, field by field,
// with its side and its time. A change of the code that keeps the digest of many seeds has moved
// code and nothing else. Of a log the level counts, not the text.
#pragma once

#include <cstdint>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/ports/ports.hpp"

namespace connect_bridge::sim {

class Digest {
 public:
  void add_action(int side, TimePoint at, const Action& action);
  void add_packet(int side, TimePoint at, ConnectionId connection, bool text, ByteView bytes);

  // A number in eight bytes.
  void add(std::uint64_t number);
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  template <class T>
  void feed(const T& value);
  void feed_bytes(ByteView bytes);
  void begin(std::uint64_t kind, int side, TimePoint at);

  std::uint64_t value_ = 14695981039346656037ULL;  // FNV-1a
};

}  // namespace connect_bridge::sim
