// Byte views and the shared, immutable payload that carries one serialized message through the
// program.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace connect_bridge {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

// The bytes of a text, which must outlive the view.
[[nodiscard]] inline ByteView view_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// Bytes that several owners share and nobody changes: a message taken from ROS once and sent to
// many links, or a slice of a received packet. Copying a Payload copies a reference.
// Thread: the bytes are immutable, so a Payload may be handed to another thread.
class Payload {
 public:
  Payload() = default;

  // Takes the vector over, without copying its bytes.
  static Payload adopt(Bytes bytes) {
    auto owner = std::make_shared<const Bytes>(std::move(bytes));
    const ByteView view{*owner};
    return Payload{std::move(owner), view};
  }

  static Payload copy_of(ByteView bytes) { return adopt(Bytes{bytes.begin(), bytes.end()}); }

  // Refers to bytes that live as long as `owner` does (a middleware's buffer, a received packet).
  static Payload wrap(std::shared_ptr<const void> owner, ByteView bytes) {
    return Payload{std::move(owner), bytes};
  }

  // A part of this payload that shares its owner. `offset + size` must not exceed `size()`.
  [[nodiscard]] Payload slice(std::size_t offset, std::size_t size) const {
    return Payload{owner_, view_.subspan(offset, size)};
  }

  [[nodiscard]] ByteView view() const { return view_; }
  [[nodiscard]] std::size_t size() const { return view_.size(); }
  [[nodiscard]] bool empty() const { return view_.empty(); }

 private:
  Payload(std::shared_ptr<const void> owner, ByteView view)
      : owner_(std::move(owner)), view_(view) {}

  std::shared_ptr<const void> owner_;
  ByteView view_;
};

}  // namespace connect_bridge
