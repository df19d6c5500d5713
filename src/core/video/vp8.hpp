// VP8 by libvpx, frame by frame; the only file that knows libvpx. Without the library, which the
// build may leave out, all calls fail.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/base/bytes.hpp"
#include "core/video/yuv.hpp"

namespace connect_bridge::video {

[[nodiscard]] bool has_vp8();

class Vp8Encoder {
 public:
  explicit Vp8Encoder(Size size);
  ~Vp8Encoder();
  Vp8Encoder(Vp8Encoder&&) noexcept;
  Vp8Encoder& operator=(Vp8Encoder&&) noexcept;

  // One frame with exactly this quantiser, valid until the next call; empty: libvpx failed, and
  // fails from now on.
  [[nodiscard]] ByteView encode(const YuvView& picture, std::uint8_t quantiser, bool base);

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

class Vp8Decoder {
 public:
  Vp8Decoder();
  ~Vp8Decoder();
  Vp8Decoder(Vp8Decoder&&) noexcept;
  Vp8Decoder& operator=(Vp8Decoder&&) noexcept;

  // The picture of the frame, valid until the next call; nullopt: libvpx failed. The head of the
  // frame has been checked.
  [[nodiscard]] std::optional<YuvView> decode(ByteView frame);

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

}  // namespace connect_bridge::video
