#include "core/media/sample_codec.hpp"

#include "core/compress/compress.hpp"
#include "core/media/cloud.hpp"
#include "core/media/planes.hpp"

namespace connect_bridge::media {

std::optional<Bytes> encode_sample(ByteView raw, const Compression& how,
                                   const std::atomic<bool>* give_up) {
  switch (how.codec) {
    case Codec::kPlanes:
      return encode_columns(raw, image_columns(raw).value_or(opaque(raw.size())), how.level,
                            give_up);
    case Codec::kCloud: {
      const auto thin = how.grid_um > 0 ? thinned(raw, how.grid_um) : std::nullopt;
      const ByteView cloud = thin ? ByteView(*thin) : raw;
      return encode_columns(cloud, cloud_columns(cloud, how.step_um).value_or(opaque(cloud.size())),
                            how.level, give_up);
    }
    default: return compress(raw, how, give_up);
  }
}

Result<Bytes> decode_sample(ByteView body, Codec codec, std::size_t raw_bytes) {
  switch (codec) {
    case Codec::kPlanes: return decode_columns(body, raw_bytes, Steps::kRefused);
    case Codec::kCloud: return decode_columns(body, raw_bytes, Steps::kAllowed);
    default: return decompress(body, codec, raw_bytes);
  }
}

}  // namespace connect_bridge::media
