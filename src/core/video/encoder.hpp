// Samples of a camera to pictures of a wanted size. Nothing here reads a clock: the same samples
// and wishes give the same bytes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/base/bytes.hpp"

namespace connect_bridge::video {

struct PictureWish {
  std::uint32_t bytes = 0;      // wanted size of the body
  std::uint32_t bytes_max = 0;  // half size is better than a larger body
  bool base = false;            // the picture must refer to no other one
};

// One stream of pictures, each of which refers to the one before. Thread: any, one call at a time.
class PictureEncoder {
 public:
  PictureEncoder();
  ~PictureEncoder();
  PictureEncoder(PictureEncoder&&) noexcept;
  PictureEncoder& operator=(PictureEncoder&&) noexcept;

  // The picture is a base where the wish asks for one, at the beginning, after a failure, and where
  // size, encoding or half size change. nullopt: the sample is no picture (its alpha is not opaque,
  // for example), or a codec failed.
  [[nodiscard]] std::optional<Bytes> encode(ByteView raw, const PictureWish& wish);

 private:
  struct Stream;
  std::unique_ptr<Stream> stream_;
};

}  // namespace connect_bridge::video
