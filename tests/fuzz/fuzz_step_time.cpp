// How long one packet takes a side on which the peer and the graph have much, whatever its content:
// a piece of bytes that is repeated, each '#' in it a number (of texts), until the packet is as
// large as a peer may send it, or so often as a byte says. Input: a byte for what the pieces are
// of, one for how many, the piece.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "bench/control_shapes.hpp"
#include "bench/loaded_side.hpp"
#include "fuzz/slow.hpp"

using namespace connect_bridge;

namespace {

struct Around {
  const char* before;
  const char* after;
};

// The last entry is a packet of frames.
constexpr std::array<Around, 13> kAround = {{
    {R"({"type":"demand","channels":[{"channel":1,"number":2})", "]}"},
    {R"({"type":"demand","channels":[{"channel":1,"number":0})", "]}"},
    {R"({"type":"withdraw","channels":[400)", "]}"},
    {R"({"type":"offer","channels":[{"channel":900,)"
     R"("kind":"topic","name":"/n","type":"p/msg/T","origins":[]})",
     "]}"},
    {R"({"type":"origins","channel":1,"removed":[],"added":[{"origin":900,)"
     R"("gid":"030000000000000000000000000000000000000000000009","qos":{}})",
     "]}"},
    {R"({"type":"origins","channel":1,"added":[],"removed":[1)", "]}"},
    {R"({"type":"listeners","removed":[],"added":[)"
     R"({"listener":900,"name":"/l","type":"p/msg/T"})",
     "]}"},
    {R"({"type":"listeners","added":[],"removed":[1)", "]}"},
    {R"({"type":"accepts","deny":[],"rules":[{"topics":["/a")", R"(],"types":[]}]})"},
    {R"({"type":"accepts","deny":[],"rules":[{"topics":["/a"],"types":[]})", "]}"},
    {R"({"type":"accepts","rules":[{"topics":["/**"],"types":[]}],"deny":["/a")", "]}"},
    {"", ""},
    {nullptr, nullptr},
}};
constexpr std::array<std::size_t, 6> kCounts = {1, 64, 256, 1024, 4096, kPacketBytesMax};

Bytes repeated(ByteView piece, std::size_t count) {
  Bytes packet;
  for (std::size_t i = 0; i < count && packet.size() + piece.size() <= kPacketBytesMax; ++i)
    packet.insert(packet.end(), piece.begin(), piece.end());
  return packet;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3) return 0;
  const Around& around = kAround[data[0] % kAround.size()];
  const std::size_t count = kCounts[data[1] % kCounts.size()];
  const ByteView piece{data + 2, size - 2};
  Bytes packet;
  if (around.before == nullptr) {
    packet = repeated(piece, count);
  } else {
    const std::string_view words{reinterpret_cast<const char*>(piece.data()), piece.size()};
    const std::string text = bench::filled(around.before, words, around.after, count);
    packet = {text.begin(), text.end()};
  }
  check_quick("a step of the loop", [&] {
    bench::LoadedSide side(100, 100, 64);
    return side.seconds_for(around.before != nullptr, packet);
  });
  return 0;
}
