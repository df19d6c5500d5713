// A topic that a peer offers on channel 1, without a side.
#pragma once

#include <memory>
#include <string>

#include "core/compress/compress.hpp"
#include "unit/mirrors/importing.hpp"

namespace connect_bridge::topics_test {

struct OfferedScript : Importing {
  explicit OfferedScript(Duration resume_for = {})
      : one(1, std::make_shared<Account>(), resume_for) {}
  ~OfferedScript() { context.mirrors.all().clear(); }  // before the links, whose memory they hold
  IncomingChannel& channel_1() { return *one.link.incoming({1})->channel; }
  void give(InMessage message, std::int64_t at = 0) {
    EXPECT_TRUE(channel_1().on_message(std::move(message), ms(at)));
  }
  // A worker decompresses it.
  static InMessage large(const std::string& text, std::uint16_t demand = 0) {
    InMessage result = message("", demand);
    const Payload raw = sample(text);
    result.body = Payload::adopt(compress(raw.view(), {Codec::kZstd, 3}).value());
    result.codec = Codec::kZstd;
    result.raw_bytes = static_cast<std::uint32_t>(raw.size());
    return result;
  }
  static InMessage large(std::uint16_t demand = 0) { return large(std::string(2000, 'x'), demand); }
  std::uint64_t dropped(DropReason reason) const {
    LinkStatus status;
    peer.add_status(status);
    return status.topics.at(0).dropped.of(reason);
  }

  OneLink one;
  LinkTopics peer{context, one.link};
};

}  // namespace connect_bridge::topics_test
