// The compression of samples by every codec, those of pictures and clouds and those of all bytes.
#pragma once

#include <atomic>
#include <optional>

#include "core/base/bytes.hpp"
#include "core/base/result.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge::media {

// As compress(). A sample of another type than the codec is made for is compressed by zstd, under
// the same codec.
[[nodiscard]] std::optional<Bytes> encode_sample(ByteView raw, const Compression& how,
                                                 const std::atomic<bool>* give_up = nullptr);

// As decompress().
[[nodiscard]] Result<Bytes> decode_sample(ByteView body, Codec codec, std::size_t raw_bytes);

}  // namespace connect_bridge::media
