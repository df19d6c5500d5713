// The control texts that wait to be sent.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <utility>

#include "core/flow/packet.hpp"

namespace connect_bridge {

class ControlQueue {
 public:
  // False: it would exceed `bytes_max`, and nothing was queued.
  [[nodiscard]] bool push(std::string text, std::uint64_t bytes_max) {
    if (bytes_ + text.size() > bytes_max) return false;
    bytes_ += text.size();
    texts_.push_back(std::move(text));
    return true;
  }
  // The next text. Only if one waits.
  Packet take() {
    const std::string text = std::move(texts_.front());
    texts_.pop_front();
    bytes_ -= text.size();
    Packet packet;
    packet.text = true;
    packet.pieces.push_back(Payload::adopt(Bytes(text.begin(), text.end())));
    return packet;
  }
  [[nodiscard]] bool empty() const { return texts_.empty(); }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  std::deque<std::string> texts_;
  std::uint64_t bytes_ = 0;
};

}  // namespace connect_bridge
