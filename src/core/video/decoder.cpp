#include "core/video/decoder.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/base/byte_order.hpp"
#include "core/video/body.hpp"
#include "core/video/jpeg.hpp"
#include "core/video/vp8.hpp"
#include "core/video/yuv.hpp"

namespace connect_bridge::video {

struct PictureDecoder::Stream {
  std::optional<Vp8Decoder> vp8;  // none: a base must come
  Size size;
  Yuv enlarged;
  JpegWriter jpeg;

  std::optional<Bytes> decode(const PictureBody& body) {
    const Size coded = body.shape.coded(body.half);
    if (body.base && (!vp8 || size != coded)) vp8.emplace();
    if (!vp8 || (!body.base && size != coded)) return std::nullopt;
    size = coded;
    auto picture = vp8->decode(body.frame);
    if (!picture || picture->size != coded) return std::nullopt;
    if (body.half) {
      enlarge(*picture, body.shape, enlarged);
      picture = enlarged.view();
    }
    if (body.shape.is_jpeg()) return compressed(body, *picture);
    Bytes raw(body.raw_bytes());
    std::copy(body.prefix.begin(), body.prefix.end(), raw.begin());
    from_yuv(*picture, body.shape, raw.data() + body.prefix.size());
    return raw;
  }

  std::optional<Bytes> compressed(const PictureBody& body, const YuvView& picture) {
    const ByteView written = jpeg.write(picture, body.shape.is_grey_jpeg());
    constexpr std::size_t kLengthBytes = 4;
    if (written.empty() || kLengthBytes + written.size() > body.shape.data_bytes())
      return std::nullopt;
    Bytes raw(body.prefix.begin(), body.prefix.end());
    raw.reserve(raw.size() + kLengthBytes + written.size());
    put_le(static_cast<std::uint32_t>(written.size()), raw);
    raw.insert(raw.end(), written.begin(), written.end());
    return raw;
  }
};

PictureDecoder::PictureDecoder() : stream_(std::make_unique<Stream>()) {}
PictureDecoder::~PictureDecoder() = default;
PictureDecoder::PictureDecoder(PictureDecoder&&) noexcept = default;
PictureDecoder& PictureDecoder::operator=(PictureDecoder&&) noexcept = default;

Result<Bytes> PictureDecoder::decode(ByteView body, std::size_t raw_bytes) {
  const auto read = read_body(body);
  std::optional<Bytes> raw;
  if (read && read->raw_bytes() == raw_bytes) raw = stream_->decode(*read);
  if (raw) return std::move(*raw);
  stream_->vp8.reset();
  return malformed("a picture does not decode to its size");
}

}  // namespace connect_bridge::video
