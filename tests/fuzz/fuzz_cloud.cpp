// Clouds: hostile bodies, and hostile samples that are made a body, exact, with a step, or thinned.
// Input: a byte that chooses the way, three bytes of announced size, the body or sample.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/base/check.hpp"
#include "core/media/cloud.hpp"
#include "core/media/layouts.hpp"
#include "core/media/sample_codec.hpp"

using namespace connect_bridge;

namespace {

// Whether all bytes but those of coordinates are the same.
bool same_but_for_coordinates(ByteView before, ByteView after) {
  const auto cloud = media::cloud_layout(before);
  Bytes moved(before.size());
  if (cloud)
    for (const auto& field : cloud->fields)
      if (field.name == "x" || field.name == "y" || field.name == "z")
        for (std::uint32_t point = 0; point < cloud->points(); ++point)
          for (std::uint32_t byte = 0; byte < 4 && field.offset + byte < cloud->point_step; ++byte)
            moved[cloud->data.begin + std::size_t{point} * cloud->point_step + field.offset +
                  byte] = 1;
  for (std::size_t i = 0; i < before.size(); ++i)
    if (moved[i] == 0 && before[i] != after[i]) return false;
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 4) return 0;
  const std::size_t announced = data[1] | std::size_t{data[2]} << 8 | std::size_t{data[3]} << 16;
  const ByteView body{data + 4, size - 4};
  const auto raw = media::decode_sample(body, Codec::kCloud, announced);
  CONNECT_CHECK(!raw.ok() || (raw.value().size() == announced && announced > 0));

  const std::uint32_t step_um = (data[0] & 1) != 0 ? 1U << (data[0] >> 4) : 0;
  if (const auto shrunk = media::encode_sample(body, {Codec::kCloud, 1, false, step_um})) {
    const auto back = media::decode_sample(*shrunk, Codec::kCloud, body.size());
    CONNECT_CHECK(back.ok());
    if (step_um == 0) {
      CONNECT_CHECK(back.value() == Bytes(body.begin(), body.end()));
    } else {
      CONNECT_CHECK(same_but_for_coordinates(body, back.value()));
    }
  }
  if (const auto thin = media::thinned(body, 1 + data[0])) {
    const auto cloud = media::cloud_layout(*thin);
    CONNECT_CHECK(thin->size() <= body.size());
    CONNECT_CHECK(cloud || thin->size() < body.size());  // perhaps no point is left
  }
  return 0;
}
