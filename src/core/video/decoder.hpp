// Pictures back to samples: header, size, encoding and step are those of the sender's sample.
#pragma once

#include <cstddef>
#include <memory>

#include "core/base/bytes.hpp"
#include "core/base/result.hpp"

namespace connect_bridge::video {

// One stream of pictures, in the order of the encoder. Thread: any, one call at a time.
class PictureDecoder {
 public:
  PictureDecoder();
  ~PictureDecoder();
  PictureDecoder(PictureDecoder&&) noexcept;
  PictureDecoder& operator=(PictureDecoder&&) noexcept;

  // Exactly `raw_bytes` bytes, for a JPEG at most so many, or kMalformed. After a failure, deltas
  // are malformed up to the next base. The caller has checked `raw_bytes` against its limit; libvpx
  // sees nothing of a body that does not agree with it.
  Result<Bytes> decode(ByteView body, std::size_t raw_bytes);

 private:
  struct Stream;
  std::unique_ptr<Stream> stream_;
};

}  // namespace connect_bridge::video
