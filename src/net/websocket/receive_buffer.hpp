// The buffer into which a packet is received: a dynamic buffer (Asio's DynamicBuffer_v1) that
// becomes the Payload.
#pragma once

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <cstring>
#include <limits>
#include <memory>

#include "core/base/bytes.hpp"

namespace connect_bridge {

class ReceiveBuffer {
 public:
  using const_buffers_type = boost::asio::const_buffer;      // NOLINT: the names Asio asks for
  using mutable_buffers_type = boost::asio::mutable_buffer;  // NOLINT

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t capacity() const { return capacity_; }
  // The limit is the WebSocket's read_message_max.
  [[nodiscard]] std::size_t max_size() const { return std::numeric_limits<std::size_t>::max() / 2; }
  [[nodiscard]] const_buffers_type data() const { return {bytes_.get(), size_}; }

  mutable_buffers_type prepare(std::size_t bytes) {
    if (capacity_ - size_ < bytes) grow(size_ + bytes);
    return {bytes_.get() + size_, bytes};
  }
  void commit(std::size_t bytes) { size_ += std::min(bytes, capacity_ - size_); }
  void consume(std::size_t bytes) {
    const std::size_t gone = std::min(bytes, size_);
    size_ -= gone;
    if (size_ > 0) std::memmove(bytes_.get(), bytes_.get() + gone, size_);
  }

  // The received bytes, as a Payload; empties the buffer. A buffer that is at least half full hands
  // over its memory. A smaller message is copied, so that keeping it does not keep much more
  // memory.
  Payload take() {
    const ByteView view{bytes_.get(), size_};
    size_ = 0;
    if (view.size() < capacity_ / 2) return Payload::copy_of(view);
    capacity_ = 0;
    std::shared_ptr<const void> owner = std::move(bytes_);
    return Payload::wrap(std::move(owner), view);
  }

 private:
  void grow(std::size_t needed) {
    // Beast announces the rest of a frame when it knows it, so this is exact for a packet of one
    // frame; one that arrives in many frames grows by half each time.
    const std::size_t capacity =
        size_ == 0 ? std::max(needed, kBytesMin) : std::max(needed, capacity_ + capacity_ / 2);
    std::shared_ptr<std::uint8_t[]> bytes(new std::uint8_t[capacity]);  // not zeroed
    if (size_ > 0) std::memcpy(bytes.get(), bytes_.get(), size_);
    bytes_ = std::move(bytes);
    capacity_ = capacity;
  }

  static constexpr std::size_t kBytesMin = 2048;
  std::shared_ptr<std::uint8_t[]> bytes_;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
};

}  // namespace connect_bridge
