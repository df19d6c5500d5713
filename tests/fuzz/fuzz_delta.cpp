// Messages that refer to the one before: nothing but exactly the announced size comes out of
// hostile ones, and what went in comes out of our own. Input: three bytes of announced size, one of
// the size of the base, the base, the body.
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/base/check.hpp"
#include "core/compress/compress.hpp"

using namespace connect_bridge;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 4) return 0;
  const std::size_t announced = data[0] | std::size_t{data[1]} << 8 | std::size_t{data[2]} << 16;
  const ByteView rest{data + 4, size - 4};
  const ByteView base = rest.first(std::min<std::size_t>(data[3], rest.size()));
  const ByteView body = rest.subspan(base.size());
  const auto raw = decompress_delta(body, base, announced);
  CONNECT_CHECK(!raw.ok() || raw.value().size() == announced);

  const auto shrunk = compress_delta(body, base, 1 + data[0] % 4);
  if (!shrunk) return 0;
  CONNECT_CHECK(shrunk->size() < body.size());
  const auto back = decompress_delta(*shrunk, base, body.size());
  CONNECT_CHECK(back.ok() && back.value() == Bytes(body.begin(), body.end()));
  return 0;
}
