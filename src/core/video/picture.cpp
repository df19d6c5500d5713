#include "core/video/picture.hpp"

#include "core/video/body.hpp"
#include "core/video/vp8.hpp"

namespace connect_bridge::video {

bool available() {
  return has_vp8();
}

std::optional<PictureFacts> facts_of(ByteView body) {
  const auto read = read_body(body);
  if (!read) return std::nullopt;
  return PictureFacts{read->base, read->half, read->quantiser, read->raw_bytes()};
}

bool is_picture(ByteView raw) {
  return read_sample(raw).has_value();
}

}  // namespace connect_bridge::video
