// Puts the parts of messages together again, within a budget.
#pragma once

#include <cstdint>
#include <memory>
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
// with its code. The caller keeps a stream for each channel that was offered, and so bounds them.
class Reassembly {
 public:
  // The receiving state of one channel: its last sequence and its unfinished message. A stream ends
  // before the Reassembly does.
  class Stream {
   public:
    // Nothing has come yet: it continues after this sequence of an earlier connection.
    void go_on(std::uint32_t sequence) { last_sequence_ = sequence; }

   private:
    friend class Reassembly;
    struct Open {
      InMessage message;  // without its body
      std::uint32_t missing = 0;
      Bytes body;
      Budget::Hold kept;
    };

    std::uint32_t last_sequence_ = 0;
    std::optional<Open> open_;
  };

  explicit Reassembly(ReassemblyOptions options) : options_(options) {}

  // To be called before anything comes. Unfinished messages also count in this budget, which
  // outlives this. If it has no room for a message, that message arrives without its body
  // (InMessage::kept).
  void draw_from(Budget& memory) {
    memory_ = &memory;
    open_ = std::make_unique<Budget>(&memory);
  }

  // `packet` is the packet in which the frame's part lies: a message that is whole in one frame
  // becomes a slice of it, without a copy. `keep`: false for a message that will be dropped anyway;
  // its parts are checked, but take no memory and no budget, and its body stays empty.
  // The stream is that of the frame's channel.
  Result<std::optional<InMessage>> on_message(Stream& stream, const MessageFrame& frame,
                                              const Payload& packet, bool keep = true);
  Result<std::optional<InMessage>> on_part(Stream& stream, const PartFrame& frame);

  [[nodiscard]] std::uint64_t open_bytes() const { return open_->used(); }

 private:
  ReassemblyOptions options_;
  Budget* memory_ = nullptr;
  std::unique_ptr<Budget> open_ = std::make_unique<Budget>();  // of all streams; does not move
};

}  // namespace connect_bridge
