#include "core/flow/packet.hpp"

#include <utility>

namespace connect_bridge {

std::size_t Packet::size() const {
  std::size_t sum = 0;
  for (const auto& piece : pieces) sum += piece.size();
  return sum;
}

void PacketBuilder::add(const Frame& frame) {
  append_header(frame, head_);
  ++frames_;
}

void PacketBuilder::add(const Frame& frame, const Payload& body, std::size_t offset,
                        std::size_t size) {
  add(frame);
  if (size <= kCopiedPartBytesMax) {
    const auto part = body.view().subspan(offset, size);
    head_.insert(head_.end(), part.begin(), part.end());
  } else {
    referred_.push_back({head_.size(), body.slice(offset, size)});
    referred_bytes_ += size;
  }
}

Packet PacketBuilder::finish() {
  Packet packet;
  // The copy has the exact size: a packet may wait long at the socket, and the builder's buffer is
  // large.
  const auto head = Payload::copy_of(head_);
  if (referred_.empty()) {
    packet.pieces.push_back(head);
  } else {
    packet.pieces.reserve(2 * referred_.size() + 1);
    std::size_t begin = 0;
    for (auto& [head_end, part] : referred_) {
      packet.pieces.push_back(head.slice(begin, head_end - begin));
      packet.pieces.push_back(std::move(part));
      begin = head_end;
    }
    if (begin < head.size()) packet.pieces.push_back(head.slice(begin, head.size() - begin));
  }
  head_.clear();
  referred_.clear();
  referred_bytes_ = 0;
  frames_ = 0;
  return packet;
}

}  // namespace connect_bridge
