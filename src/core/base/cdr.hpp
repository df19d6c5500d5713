// The few CDR messages that the bridge itself writes and reads: little-endian plain CDR, the
// representation that every ROS 2 middleware writes (OMG DDSI-RTPS 2.3, section 10).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/byte_order.hpp"
#include "core/base/bytes.hpp"

namespace connect_bridge {

// A serialized sample begins with its encapsulation (RTPS 2.3 section 10.2): a known representation
// identifier in two bytes, then two bytes of options.
[[nodiscard]] inline bool is_serialized(ByteView raw) {
  return raw.size() >= 4 && raw[0] == 0 && raw[1] <= 0x0b;
}

// Alignment counts from the end of the encapsulation.
inline constexpr std::size_t kCdrHeaderBytes = 4;

class CdrWriter {
 public:
  CdrWriter& u8(std::uint8_t value) { return number(value); }
  CdrWriter& u32(std::uint32_t value) { return number(value); }
  CdrWriter& u64(std::uint64_t value) { return number(value); }
  // Writes the length, which includes the terminating zero, then the text and the zero.
  CdrWriter& string(std::string_view text) {
    u32(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.push_back(0);
    return *this;
  }
  [[nodiscard]] Payload take() { return Payload::adopt(std::move(bytes_)); }

 private:
  template <class T>
  CdrWriter& number(T value) {
    while ((bytes_.size() - kCdrHeaderBytes) % sizeof(T) != 0) bytes_.push_back(0);
    put_le(value, bytes_);
    return *this;
  }

  Bytes bytes_{0, 1, 0, 0};
};

// Every position is checked; after a failure all further reads fail.
class CdrReader {
 public:
  explicit CdrReader(ByteView bytes) : bytes_(bytes) {
    if (bytes_.size() < 4 || bytes_[0] != 0 || bytes_[1] != 1) at_ = bytes_.size() + 1;
  }
  std::optional<std::uint8_t> u8() { return number<std::uint8_t>(); }
  std::optional<std::uint32_t> u32() { return number<std::uint32_t>(); }
  std::optional<std::uint64_t> u64() { return number<std::uint64_t>(); }
  // The result points into the bytes that are read.
  std::optional<std::string_view> string() {
    const auto size = u32();
    if (!size || *size == 0 || !has(*size)) {
      at_ = bytes_.size() + 1;
      return std::nullopt;
    }
    const std::string_view text(reinterpret_cast<const char*>(bytes_.data() + at_), *size - 1);
    at_ += *size;
    return text;
  }
  // A sequence of bytes; the result points into those that are read.
  std::optional<ByteView> octets() {
    const auto size = u32();
    if (!size || !has(*size)) {
      at_ = bytes_.size() + 1;
      return std::nullopt;
    }
    at_ += *size;
    return bytes_.subspan(at_ - *size, *size);
  }
  // The bytes that are not read yet; none after a failure.
  [[nodiscard]] ByteView rest() const {
    return at_ <= bytes_.size() ? bytes_.subspan(at_) : ByteView{};
  }

 private:
  template <class T>
  std::optional<T> number() {
    while (at_ <= bytes_.size() && (at_ - kCdrHeaderBytes) % sizeof(T) != 0) ++at_;
    if (!has(sizeof(T))) {
      at_ = bytes_.size() + 1;
      return std::nullopt;
    }
    at_ += sizeof(T);
    return get_le<T>(bytes_, at_ - sizeof(T));
  }
  [[nodiscard]] bool has(std::size_t size) const {
    return at_ <= bytes_.size() && size <= bytes_.size() - at_;
  }

  ByteView bytes_;
  std::size_t at_ = kCdrHeaderBytes;
};

}  // namespace connect_bridge
