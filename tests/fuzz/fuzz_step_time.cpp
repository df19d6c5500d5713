// How long one packet takes a side on which peers and the graph have much, whatever its content: a
// piece of bytes that is repeated, each '#' in it a number (of texts), until the packet is as large
// as a peer may send it, or so often as a byte says. Then events happen: links end, one by one and
// together, and come back, a node starts and ends, time passes. Input: a byte for what the pieces
// are of, and for what the peers offer, one for how many, one for the number of events, the events,
// the piece.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

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

// Many links of one identity, and one of another.
constexpr std::size_t kLinks = 32;
std::vector<std::string> identities() {
  std::vector<std::string> all(kLinks, "driver");
  all.back() = "other";
  return all;
}
constexpr std::size_t kEventsMax = 16;
constexpr unsigned kRestMax = 16;  // 2^15 ms

struct Sent {
  bool text = true;
  Bytes packet;
};

// The low bits say what happens, the others to which link, or for how long.
void happen(bench::LoadedSide& side, std::uint8_t event, const Sent& sent) {
  const unsigned which = event / 8;
  const std::size_t link = which % kLinks;
  switch (event % 8) {
    case 0: return side.send(link, sent.text, sent.packet);
    case 1: return side.lose(link);
    case 2:
      for (std::size_t lost = link; lost < kLinks; ++lost) side.lose(lost);
      return;
    case 3: return side.come_back(link);
    case 4:
      return side.run_node(bench::LoadedSide::Node{2 * which, 2 * (which % 8), which % 4,
                                                   8 * (which % 16), 4 * (which % 4), which});
    case 5: return side.run_node(false);
    default: return side.rest(std::chrono::milliseconds(1U << which % kRestMax));
  }
}

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
  const std::size_t events = std::min({std::size_t{data[2]}, kEventsMax, size - 3});
  const ByteView piece{data + 3 + events, size - 3 - events};
  Sent sent{around.before != nullptr, {}};
  if (!sent.text) {
    sent.packet = repeated(piece, count);
  } else {
    const std::string_view words{reinterpret_cast<const char*>(piece.data()), piece.size()};
    const std::string text = bench::filled(around.before, words, around.after, count);
    sent.packet = {text.begin(), text.end()};
  }
  check_quick("a step of the loop", [&] {
    const unsigned what = data[0] / kAround.size();
    const auto kind = what % 2 == 0 ? InterfaceKind::kTopic : InterfaceKind::kService;
    const auto durability = what / 2 % 2 == 0 ? Durability::kVolatile : Durability::kTransientLocal;
    bench::LoadedSide side(32, 32, 32, identities(), kind, durability);
    return side.seconds_of([&] {
      if (!piece.empty()) side.send(0, sent.text, sent.packet);
      for (std::size_t n = 0; n < events; ++n) happen(side, data[3 + n], sent);
      side.rest(std::chrono::seconds(1));
    });
  });
  return 0;
}
