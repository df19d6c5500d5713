// A packet of any bytes: what is read must be exactly what would be written.
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/base/check.hpp"
#include "core/wire/frame.hpp"
#include "fuzz/slow.hpp"

using namespace connect_bridge;

namespace {

ByteView part_of(const Frame& frame) {
  if (const auto* message = std::get_if<MessageFrame>(&frame)) return message->part;
  if (const auto* part = std::get_if<PartFrame>(&frame)) return part->part;
  if (const auto* texts = std::get_if<TextsFrame>(&frame)) return texts->body;
  return {};
}

void look(const std::uint8_t* data, std::size_t size) {
  const ByteView packet{data, size};
  Bytes written;
  FrameReader reader{packet};
  for (;;) {
    const auto next = reader.next();
    if (!next.ok()) {
      CONNECT_CHECK(!reader.next().ok());
      break;
    }
    if (!next.value()) {
      CONNECT_CHECK(written.size() == size);
      break;
    }
    append_header(*next.value(), written);
    const ByteView part = part_of(*next.value());
    written.insert(written.end(), part.begin(), part.end());
  }
  CONNECT_CHECK(written.size() <= size);
  CONNECT_CHECK(std::equal(written.begin(), written.end(), packet.begin()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return quickly("a packet", [=] { look(data, size); });
}
