// Puts the parts of messages together again, within a budget.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "core/base/budget.hpp"
#include "core/base/bytes.hpp"
#include "core/base/result.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge {

// A message whose parts have all arrived; its body may still be compressed.
struct InMessage : MessageHead {
  ChannelId channel;
  Payload body;
  bool kept = true;  // false: there was no memory for the body, which is empty
};

struct ReassemblyOptions {
  std::uint32_t message_bytes_max = 64 << 20;   // of raw_bytes and of body_bytes
  std::uint64_t open_bytes_max = 256ULL << 20;  // all unfinished messages of a link together
};

// Belongs to one connection. Checks before it allocates: sizes against the options (kTooLarge),
// parts against the open message (kMalformed), a part without an open message, a message inside
// another one or with a sequence number that does not rise (kIllegal). An error ends the connection
// with its code. The caller has checked that the channel was offered: what is kept per channel is
// bounded by that.
class Reassembly {
 public:
  explicit Reassembly(ReassemblyOptions options) : options_(options) {}

  // Unfinished messages also count in this budget, which outlives this. If it has no room for a
  // message, that message arrives without its body (InMessage::kept).
  void draw_from(Budget& memory) { memory_ = &memory; }

  // `packet` is the packet in which the frame's part lies: a message that is whole in one frame
  // becomes a slice of it, without a copy. `keep`: false for a message that will be dropped anyway;
  // its parts are checked, but take no memory and no budget, and its body stays empty.
  Result<std::optional<InMessage>> on_message(const MessageFrame& frame, const Payload& packet,
                                              bool keep = true);
  Result<std::optional<InMessage>> on_part(const PartFrame& frame);
  // The channel, on which nothing has arrived yet, continues after this sequence of an earlier
  // connection.
  void go_on(ChannelId channel, std::uint32_t sequence) {
    streams_[channel].last_sequence = sequence;
  }
  // The channel was withdrawn: forgets its unfinished message and its sequence.
  void forget(ChannelId channel);

  [[nodiscard]] std::uint64_t open_bytes() const { return open_bytes_; }

 private:
  struct Open {
    InMessage message;  // without its body
    std::uint32_t missing = 0;
    std::uint32_t kept_bytes = 0;  // of the budget
    Bytes body;
    Budget::Hold memory;
  };
  struct Stream {
    std::uint32_t last_sequence = 0;
    std::optional<Open> open;
  };
  void close(Stream& stream);

  ReassemblyOptions options_;
  Budget* memory_ = nullptr;
  std::map<ChannelId, Stream> streams_;  // not hashed: the peer chooses the numbers
  std::uint64_t open_bytes_ = 0;
};

}  // namespace connect_bridge
