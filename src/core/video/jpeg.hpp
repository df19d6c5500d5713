// JPEGs by libturbojpeg; the only file that knows it. Without the library, which the build may
// leave out, all calls fail.
#pragma once

#include <memory>

#include "core/base/bytes.hpp"
#include "core/video/yuv.hpp"

namespace connect_bridge::video {

[[nodiscard]] bool has_jpeg();

class JpegReader {
 public:
  JpegReader();
  ~JpegReader();
  JpegReader(JpegReader&&) noexcept;
  JpegReader& operator=(JpegReader&&) noexcept;

  // The planes of the JPEG, with chroma halved. False: it has another size than the shape, other
  // colours than YCbCr, too many scans, or cannot be decoded. A JPEG that ends too early or has
  // damaged data can: cameras lose bytes, and the remainder is grey.
  [[nodiscard]] bool read(ByteView jpeg, const Shape& shape, Yuv& to);

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

class JpegWriter {
 public:
  JpegWriter();
  ~JpegWriter();
  JpegWriter(JpegWriter&&) noexcept;
  JpegWriter& operator=(JpegWriter&&) noexcept;

  // A JPEG of quality 90, with chroma halved or without it, valid until the next call; empty:
  // libturbojpeg failed.
  [[nodiscard]] ByteView write(const YuvView& picture, bool is_grey);

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

}  // namespace connect_bridge::video
