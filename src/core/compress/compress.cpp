#include "core/compress/compress.hpp"

#include <lz4.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <memory>

namespace connect_bridge {
namespace {

// Compressing so many bytes takes 0.2 s at zstd's highest level.
constexpr std::size_t kUninterruptedBytesMax = 512 << 10;

// A zstd context costs more to make than a small message to compress, so each thread keeps its own.
// It holds no state between calls that could change a result.
struct FreeContext {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

ZSTD_CCtx* compress_context() {
  thread_local const std::unique_ptr<ZSTD_CCtx, FreeContext> context{ZSTD_createCCtx()};
  return context.get();
}

ZSTD_DCtx* decompress_context() {
  thread_local const std::unique_ptr<ZSTD_DCtx, FreeContext> context{ZSTD_createDCtx()};
  return context.get();
}

const char* chars(ByteView bytes) {
  return reinterpret_cast<const char*>(bytes.data());
}

// Size of the output; 0 when it does not fit into `out`.
std::size_t compress_lz4(ByteView raw, Bytes& out) {
  if (raw.size() > LZ4_MAX_INPUT_SIZE) return 0;
  const int size = LZ4_compress_default(chars(raw), reinterpret_cast<char*>(out.data()),
                                        static_cast<int>(raw.size()), static_cast<int>(out.size()));
  return size > 0 ? static_cast<std::size_t>(size) : 0;
}

std::size_t compress_zstd(ByteView raw, int level, Bytes& out) {
  ZSTD_CCtx* context = compress_context();
  if (context == nullptr) return 0;
  const std::size_t size =
      ZSTD_compressCCtx(context, out.data(), out.size(), raw.data(), raw.size(), level);
  return ZSTD_isError(size) ? 0 : size;
}

// The same piece by piece, so that it can be cancelled in between. Slower: zstd copies the input.
std::size_t compress_zstd(ByteView raw, int level, Bytes& out, const std::atomic<bool>& give_up) {
  constexpr std::size_t kPieceBytes = 128 << 10;  // some 50 ms at the highest level
  ZSTD_CCtx* context = compress_context();
  if (context == nullptr) return 0;
  ZSTD_CCtx_reset(context, ZSTD_reset_session_and_parameters);
  ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, level);
  ZSTD_CCtx_setPledgedSrcSize(context, raw.size());  // so that the frame states it
  ZSTD_outBuffer to{out.data(), out.size(), 0};
  for (ByteView rest = raw; !rest.empty();) {
    const auto piece = rest.first(std::min(rest.size(), kPieceBytes));
    rest = rest.subspan(piece.size());
    ZSTD_inBuffer from{piece.data(), piece.size(), 0};
    const auto mode = rest.empty() ? ZSTD_e_end : ZSTD_e_continue;
    std::size_t unwritten = 1;
    while (from.pos < from.size || (rest.empty() && unwritten > 0)) {
      unwritten = ZSTD_compressStream2(context, &to, &from, mode);
      if (ZSTD_isError(unwritten) || (unwritten > 0 && to.pos == to.size) || give_up) return 0;
    }
  }
  return to.pos;
}

// RFC 8878 section 3.1.1.1: a bit of the descriptor, which comes behind the magic number.
bool has_checksum(ByteView frame) {
  constexpr std::size_t kDescriptorAt = 4;
  constexpr std::uint8_t kChecksumFlag = 4;
  return frame.size() > kDescriptorAt && (frame[kDescriptorAt] & kChecksumFlag) != 0;
}

Result<Bytes> decompress_lz4(ByteView body, std::size_t raw_bytes) {
  // No lz4 block grows by more than 255; a false size is found out before it is allocated.
  constexpr std::size_t kGrowthMax = 255;
  if (body.size() > LZ4_MAX_INPUT_SIZE || raw_bytes > LZ4_MAX_INPUT_SIZE ||
      raw_bytes / kGrowthMax > body.size()) {
    return malformed("an lz4 body cannot have the announced size");
  }
  Bytes raw(raw_bytes);
  const int size = LZ4_decompress_safe(chars(body), reinterpret_cast<char*>(raw.data()),
                                       static_cast<int>(body.size()), static_cast<int>(raw_bytes));
  if (size < 0 || static_cast<std::size_t>(size) != raw_bytes) {
    return malformed("an lz4 body is damaged");
  }
  return raw;
}

Result<Bytes> decompress_zstd(ByteView body, std::size_t raw_bytes, ByteView base = {}) {
  // One frame that states its size, nothing behind it. A block takes 4 bytes at least and yields
  // 128 KiB at most (RFC 8878 section 3.1.1.2): a false size is found out before it is allocated.
  constexpr std::size_t kBlockRawMax = 128 << 10;
  constexpr std::size_t kBlockBytesMin = 4;
  // Frames of old versions of zstd would reach legacy decoders, if the library has them; hardly
  // anybody reviews these any more.
  constexpr std::array<std::uint8_t, 4> kMagic{0x28, 0xb5, 0x2f, 0xfd};
  if (body.size() < kMagic.size() || !std::equal(kMagic.begin(), kMagic.end(), body.begin()))
    return malformed("a zstd body does not begin as one of RFC 8878");
  if (ZSTD_getFrameContentSize(body.data(), body.size()) != raw_bytes ||
      ZSTD_findFrameCompressedSize(body.data(), body.size()) != body.size() ||
      raw_bytes / kBlockRawMax > body.size() / kBlockBytesMin) {
    return malformed("a zstd body is not one frame of the announced size");
  }
  ZSTD_DCtx* context = decompress_context();
  if (context == nullptr) return Error{CloseCode::kInternal, "no memory for a zstd context"};
  // The prefix holds for one frame, whatever becomes of it.
  if (!base.empty() && ZSTD_isError(ZSTD_DCtx_refPrefix(context, base.data(), base.size())))
    return Error{CloseCode::kInternal, "zstd takes no prefix"};
  Bytes raw(raw_bytes);
  const std::size_t size =
      ZSTD_decompressDCtx(context, raw.data(), raw.size(), body.data(), body.size());
  if (ZSTD_isError(size) || size != raw_bytes) return malformed("a zstd body is damaged");
  return raw;
}

}  // namespace

std::optional<Bytes> compress(ByteView raw, Compression how, const std::atomic<bool>* give_up) {
  if (raw.size() < 2 || how.codec == Codec::kNone) return std::nullopt;
  Bytes out(raw.size() - 1);  // room for less than the input: what does not fit did not shrink
  const int level = std::clamp(how.level, 1, 19);
  const bool quick = how.codec == Codec::kLz4 || raw.size() <= kUninterruptedBytesMax || !give_up;
  const std::size_t size = how.codec == Codec::kLz4 ? compress_lz4(raw, out)
                           : quick                  ? compress_zstd(raw, level, out)
                                                    : compress_zstd(raw, level, out, *give_up);
  if (size == 0) return std::nullopt;
  out.resize(size);
  out.shrink_to_fit();  // queues count the size, so the memory must not be more
  return out;
}

std::optional<Bytes> compress_delta(ByteView raw, ByteView base, int level) {
  ZSTD_CCtx* context = compress_context();
  if (context == nullptr || raw.size() < 2) return std::nullopt;
  ZSTD_CCtx_reset(context, ZSTD_reset_session_and_parameters);
  ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, std::clamp(level, 1, 19));
  ZSTD_CCtx_setParameter(context, ZSTD_c_checksumFlag, 1);
  ZSTD_CCtx_refPrefix(context, base.data(), base.size());
  Bytes out(raw.size() - 1);
  const std::size_t size = ZSTD_compress2(context, out.data(), out.size(), raw.data(), raw.size());
  if (ZSTD_isError(size)) return std::nullopt;
  out.resize(size);
  out.shrink_to_fit();
  return out;
}

Result<Bytes> decompress_delta(ByteView body, ByteView base, std::size_t raw_bytes) {
  if (!has_checksum(body)) return malformed("a delta has no checksum");  // mutant: delta_checksum
  return decompress_zstd(body, raw_bytes, base);
}

Result<Bytes> decompress(ByteView body, Codec codec, std::size_t raw_bytes) {
  if (body.empty() || raw_bytes == 0) return malformed("a compressed body is empty");
  switch (codec) {
    case Codec::kLz4: return decompress_lz4(body, raw_bytes);
    case Codec::kZstd: return decompress_zstd(body, raw_bytes);
    case Codec::kNone:
    case Codec::kZstdBase:
    case Codec::kZstdDelta:
    case Codec::kPictureBase:
    case Codec::kPictureDelta:
    case Codec::kCloud:
    case Codec::kPlanes: break;
  }
  return malformed("a body of this codec is not decompressed on its own");
}

}  // namespace connect_bridge
