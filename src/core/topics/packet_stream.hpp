// The packets of videos that somebody else has encoded, of one topic on one link.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>

#include "core/base/budget.hpp"
#include "core/jobs/encoder.hpp"
#include "core/topics/origins.hpp"
#include "core/video/packets.hpp"

namespace connect_bridge {

class TopicOffer;

// A packet refers to those before it, so no newer one replaces it. On a link that carries less than
// is published, whole groups of packets are dropped, up to the next key frame: a decoder can use
// all that arrives. Packets wait here, and the channel's queue has one at a time, for which its
// depth is enough. Belongs to one offer; single-threaded.
class PacketStream {
 public:
  // All outlive this object. `memory`: of the link.
  PacketStream(TopicOffer& offer, Budget& memory, TopicTimers timers)
      : offer_(offer), timers_(timers), bytes_(memory.hold(0)) {}
  PacketStream(const PacketStream&) = delete;
  PacketStream& operator=(const PacketStream&) = delete;

  // `packet`: what the sample is. It is lost (kNewerAvailable) if it refers to a lost one.
  void push(OutSample sample, const video::VideoPacket& packet, const Now& now);
  // A packet is lost before it came here. Without one: it is not known whose.
  void on_lost(OriginId origin, const video::VideoPacket& packet);
  void on_lost();
  // A packet has left the queue.
  void on_left(const Now& now) { go(now); }
  // A deadline of the topic has come.
  void on_time(const Now& now);
  // Loses what waits.
  void clear(DropReason reason);
  // The origin is gone.
  void end(OriginId origin);

  [[nodiscard]] bool holds(OriginId origin) const;
  [[nodiscard]] std::size_t size() const { return waiting_.size(); }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_.amount(); }

 private:
  // A publisher, its camera, and the codec.
  using StreamId = std::pair<OriginId, std::string>;
  struct Waiting {
    OutSample sample;
    StreamId stream;
    bool is_key = false;
    TimePoint since{};
  };

  void go(const Now& now);
  // Drops packets that have waited for too long, or beyond the bytes, each with its group.
  void drop_late(const Now& now);
  void drop_group(DropReason reason);
  // The queue has dropped a packet since the last call: all groups are broken.
  void note_drops();
  // The stream lacks a packet that none of the waiting ones follows: those that wait are lost up to
  // a key frame.
  void break_group(const StreamId& stream);
  void lose(const Waiting& packet, DropReason reason);
  void release(const OutSample& sample) { bytes_.resize(bytes() - sample.raw.size()); }
  [[nodiscard]] video::PacketGroups& groups_of(const StreamId& stream);

  TopicOffer& offer_;
  TopicTimers timers_;
  std::map<StreamId, video::PacketGroups> groups_;
  std::deque<Waiting> waiting_;
  Budget::Hold bytes_;       // of these
  std::uint64_t drops_ = 0;  // of the queue, as known
  ExportTimers::Timer late_;
};

}  // namespace connect_bridge
