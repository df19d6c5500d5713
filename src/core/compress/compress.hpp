// lz4 (block format) and zstd (single frame) as pure functions with a cap on the output size.
#pragma once

#include <atomic>
#include <optional>

#include "core/base/bytes.hpp"
#include "core/base/result.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge {

// nullopt when compressing does not shrink the input (or it is empty): send it uncompressed. Also
// nullopt when `give_up` became true meanwhile (a high level takes many seconds for a large
// message).
std::optional<Bytes> compress(ByteView raw, Compression how,
                              const std::atomic<bool>* give_up = nullptr);

// Exactly `raw_bytes` bytes, or kMalformed. The caller has checked `raw_bytes` against its limit;
// nothing beyond it is ever allocated for the output. Codec must not be kNone. Thread: any.
Result<Bytes> decompress(ByteView body, Codec codec, std::size_t raw_bytes);

// A body of kZstdBase (`base` is empty) or of kZstdDelta: one frame with a checksum, so that
// decoding against a wrong base is detected. nullopt when it is not smaller than `raw`.
std::optional<Bytes> compress_delta(ByteView raw, ByteView base, int level);

// The reverse of compress_delta(); errors as for decompress().
Result<Bytes> decompress_delta(ByteView body, ByteView base, std::size_t raw_bytes);

}  // namespace connect_bridge
