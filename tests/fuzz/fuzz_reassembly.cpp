// Packets of any frames into the reassembly: its budget holds, messages are as long as announced,
// and their bytes are those of the parts. Input: packets, each behind two bytes with its size.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>

#include "core/base/check.hpp"
#include "core/flow/reassembly.hpp"
#include "fuzz/slow.hpp"

using namespace connect_bridge;

namespace {

constexpr ReassemblyOptions kOptions{1 << 16, 1 << 17};

// The same in its simplest form: all parts of a channel in a row.
class Model {
 public:
  void begin(ChannelId channel, ByteView part) { append(open_[channel] = {}, part); }
  void add(ChannelId channel, ByteView part) { append(open_[channel], part); }
  void expect(const InMessage& message) {
    const Bytes& bytes = open_[message.channel];
    const ByteView body = message.body.view();
    CONNECT_CHECK(bytes == Bytes(body.begin(), body.end()));
    open_.erase(message.channel);
  }

 private:
  static void append(Bytes& bytes, ByteView part) {
    bytes.insert(bytes.end(), part.begin(), part.end());
  }
  std::map<ChannelId, Bytes> open_;
};

using Streams = std::map<ChannelId, Reassembly::Stream>;

// False: the connection would be closed.
bool feed(const Payload& packet, Reassembly& reassembly, Streams& streams, Model& model) {
  FrameReader reader{packet.view()};
  for (;;) {
    const auto next = reader.next();
    if (!next.ok()) return false;
    if (!next.value()) return true;
    Result<std::optional<InMessage>> whole{std::optional<InMessage>{}};
    if (const auto* message = std::get_if<MessageFrame>(&*next.value())) {
      whole = reassembly.on_message(streams[message->channel], *message, packet);
      if (whole.ok()) model.begin(message->channel, message->part);
    } else if (const auto* part = std::get_if<PartFrame>(&*next.value())) {
      whole = reassembly.on_part(streams[part->channel], *part);
      if (whole.ok()) model.add(part->channel, part->part);
    }
    if (!whole.ok()) return false;
    CONNECT_CHECK(reassembly.open_bytes() <= kOptions.open_bytes_max);
    if (whole.value()) model.expect(*whole.value());
  }
}

void look(const std::uint8_t* data, std::size_t size) {
  Reassembly reassembly{kOptions};
  Streams streams;
  Model model;
  ByteView rest{data, size};
  while (rest.size() >= 2) {
    const std::size_t bytes = std::min<std::size_t>(rest[0] | rest[1] << 8, rest.size() - 2);
    if (!feed(Payload::copy_of(rest.subspan(2, bytes)), reassembly, streams, model)) break;
    rest = rest.subspan(2 + bytes);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return quickly("packets", [=] { look(data, size); });
}
