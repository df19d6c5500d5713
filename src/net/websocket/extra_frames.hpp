// The cost of a peer's bytes that are no messages.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

namespace connect_bridge {

// Counts frames that are no messages. The WebSocket layer does not report control frames (pings),
// frames without content, or in how many pieces a message came. But their headers are bytes that
// were read and are not content. A read of a few bytes, such as a TLS record of one byte, costs as
// much as a frame and is counted, too.
class ExtraFrames {
 public:
  // The bytes read of the connection so far are its handshake.
  explicit ExtraFrames(std::uint64_t read_bytes) : read_(read_bytes), heads_(read_bytes) {}

  // Before a read, when nearly all that was read has been understood. All numbers count from the
  // start; `content`: of messages, the unfinished one among them. Returns how many frames came
  // since the last call beyond one a message, as small as they can be: never too many. One more if
  // the read before was a small one within a message.
  std::uint64_t count(std::uint64_t read_bytes, std::uint64_t content, std::uint64_t messages) {
    const std::uint64_t heads = read_bytes - content;
    const std::uint64_t begun = messages - std::exchange(messages_, messages) + 1;
    const std::uint64_t usual =
        std::exchange(heads_, std::max(heads, heads_)) + begun * kHeadBytesMax;
    const std::uint64_t brought = read_bytes - std::exchange(read_, read_bytes);
    const bool sliver = brought > 0 && brought < kSliverBytes && begun == 1;
    const std::uint64_t extra =
        heads > usual ? (heads - usual) / kHeadBytesMin : std::uint64_t{sliver};
    total_ += extra;
    return extra;
  }
  [[nodiscard]] std::uint64_t total() const { return total_; }

 private:
  // RFC 6455 section 5.2: a client's without content, and the longest.
  static constexpr std::uint64_t kHeadBytesMin = 6;
  static constexpr std::uint64_t kHeadBytesMax = 14;

  // Less than any network cuts a stream into.
  static constexpr std::uint64_t kSliverBytes = 128;

  std::uint64_t read_;
  std::uint64_t heads_;  // bytes that are no content
  std::uint64_t messages_ = 0;
  std::uint64_t total_ = 0;
};

}  // namespace connect_bridge
