// Bodies of planes: nothing but exactly the announced size comes out, and a sample comes back bit
// for bit, whether it is an Image or not.
// Input: three bytes of announced size, then a body, which is also taken for a sample.
#include <cstddef>
#include <cstdint>

#include "core/base/check.hpp"
#include "core/media/columns.hpp"
#include "core/media/sample_codec.hpp"

using namespace connect_bridge;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3) return 0;
  const std::size_t announced = data[0] | std::size_t{data[1]} << 8 | std::size_t{data[2]} << 16;
  const ByteView body{data + 3, size - 3};
  const auto raw = media::decode_sample(body, Codec::kPlanes, announced);
  CONNECT_CHECK(!raw.ok() || (raw.value().size() == announced && announced > 0));
  if (const auto facts = media::facts_of(body); facts && raw.ok())
    CONNECT_CHECK(facts->raw_bytes == announced && facts->step_um == 0);

  const auto shrunk = media::encode_sample(body, {Codec::kPlanes, 1});
  if (!shrunk) return 0;
  CONNECT_CHECK(shrunk->size() < body.size());
  const auto back = media::decode_sample(*shrunk, Codec::kPlanes, body.size());
  CONNECT_CHECK(back.ok());
  CONNECT_CHECK(back.value() == Bytes(body.begin(), body.end()));
  return 0;
}
