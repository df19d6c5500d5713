// Bodies of pictures, and libvpx and libturbojpeg behind their checks: nothing but a sample of the
// stated size comes out, or of a JPEG at most that. What is a picture comes back with its own
// beginning.
// Input: bodies of one stream, each behind two bytes of its size; the whole is also taken for a
// sample.
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/base/byte_order.hpp"
#include "core/base/check.hpp"
#include "core/video/body.hpp"
#include "core/video/decoder.hpp"
#include "core/video/encoder.hpp"
#include "core/video/picture.hpp"

using namespace connect_bridge;

namespace {

void decode_one(video::PictureDecoder& decoder, ByteView body) {
  const auto facts = video::facts_of(body);
  // What is larger takes longer, and nothing else.
  constexpr std::uint64_t kRawBytesMax = 1 << 18;
  const std::uint64_t raw_bytes = facts ? std::min(facts->raw_bytes, kRawBytesMax) : 100;
  const auto raw = decoder.decode(body, raw_bytes);
  if (!raw.ok()) return;
  CONNECT_CHECK(facts && raw.value().size() <= facts->raw_bytes);
  CONNECT_CHECK(facts->jpeg || raw.value().size() == facts->raw_bytes);
  CONNECT_CHECK(video::is_picture(raw.value()));
}

void encode_and_decode(ByteView sample) {
  // What is larger takes longer, and nothing else.
  constexpr std::uint64_t kPixelsMax = 1 << 17;
  const auto parts = video::read_sample(sample);
  if (sample.size() > 1 << 16 ||
      (parts && std::uint64_t{parts->shape.size.width} * parts->shape.size.height > kPixelsMax))
    return;
  video::PictureEncoder encoder;
  const auto body = encoder.encode(sample, {2000, 2000});
  if (!body) return;
  CONNECT_CHECK(video::is_picture(sample));
  const auto facts = video::facts_of(*body);
  CONNECT_CHECK(facts);
  // A body does not carry what a middleware fills a sample up with.
  const std::size_t prefix_bytes = parts->prefix.size();
  CONNECT_CHECK(facts->jpeg || facts->raw_bytes == prefix_bytes + parts->data.size());
  const auto raw = video::PictureDecoder().decode(*body, facts->raw_bytes);
  CONNECT_CHECK(raw.ok() && video::is_picture(raw.value()));
  CONNECT_CHECK(std::equal(sample.begin(), sample.begin() + static_cast<long>(prefix_bytes),
                           raw.value().begin()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteView all{data, size};
  video::PictureDecoder decoder;
  for (ByteView rest = all; rest.size() > 2;) {
    const std::size_t bytes =
        std::min<std::size_t>(get_le<std::uint16_t>(rest, 0), rest.size() - 2);
    decode_one(decoder, rest.subspan(2, bytes));
    rest = rest.subspan(2 + bytes);
  }
  encode_and_decode(all);
  return 0;
}
