// Compressed bodies: nothing but exactly the announced size comes out, and what went in comes out.
// Input: a byte that chooses the codec, three bytes of announced size, the body.
#include <cstddef>
#include <cstdint>

#include "core/base/check.hpp"
#include "core/compress/compress.hpp"

using namespace connect_bridge;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 4) return 0;
  const Codec codec = (data[0] & 1) != 0 ? Codec::kZstd : Codec::kLz4;
  const std::size_t announced = data[1] | std::size_t{data[2]} << 8 | std::size_t{data[3]} << 16;
  const ByteView body{data + 4, size - 4};
  const auto raw = decompress(body, codec, announced);
  CONNECT_CHECK(!raw.ok() || (raw.value().size() == announced && announced > 0));

  const auto shrunk = compress(body, {codec, 1 + data[0] % 4});
  if (!shrunk) return 0;
  CONNECT_CHECK(shrunk->size() < body.size());
  const auto back = decompress(*shrunk, codec, body.size());
  CONNECT_CHECK(back.ok());
  CONNECT_CHECK(back.value() == Bytes(body.begin(), body.end()));
  return 0;
}
