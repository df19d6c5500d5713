#include "core/topics/packet_stream.hpp"

#include <algorithm>

#include "core/topics/topic_offer.hpp"

namespace connect_bridge {
namespace {

// A key frame is some ten times as large as others, and those behind it wait meanwhile.
constexpr Duration kWaitMost = std::chrono::seconds(1);
constexpr std::uint64_t kBytesMax = 8 << 20;
// Streams of one topic that are told apart: a publisher chooses the names.
constexpr std::size_t kStreamsMax = 64;

}  // namespace

video::PacketGroups& PacketStream::groups_of(const StreamId& stream) {
  if (groups_.size() >= kStreamsMax && !groups_.contains(stream)) groups_.clear();
  return groups_[stream];
}

void PacketStream::push(OutSample sample, const video::VideoPacket& packet, const Now& now) {
  note_drops();
  StreamId stream{sample.subject.origin(), std::string(packet.codec) += packet.frame_id};
  if (packet.is_key) {  // the newest group counts
    for (std::size_t i = 0; i < waiting_.size();) {
      if (waiting_[i].stream != stream) {
        ++i;
        continue;
      }
      lose(waiting_[i], DropReason::kNewerAvailable);
      waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  if (!groups_of(stream).takes(packet.is_key))  // mutant: packets_of_lost_ones
    return offer_.lose(sample, DropReason::kNewerAvailable);
  sample.state.reset();
  sample.reports_leaving = true;
  bytes_.resize(bytes() + sample.raw.size());
  waiting_.push_back({std::move(sample), std::move(stream), packet.is_key, now.steady});
  go(now);
}

void PacketStream::go(const Now& now) {
  note_drops();
  drop_late(now);
  const ChannelQueue* const queue = offer_.queue();
  while (!waiting_.empty() && queue && queue->counts().queued == 0) {
    const Waiting next = std::move(waiting_.front());
    waiting_.pop_front();
    release(next.sample);
    offer_.send(next.sample, Codec::kNone, next.sample.raw, now);
    note_drops();
  }
  late_.cancel();
  if (!waiting_.empty()) late_ = timers_.set(waiting_.front().since + kWaitMost);
}

void PacketStream::on_time(const Now& now) {
  if (late_ && late_.at() <= now.steady) go(now);
}

void PacketStream::drop_late(const Now& now) {
  while (!waiting_.empty() && waiting_.front().since + kWaitMost <= now.steady)
    drop_group(DropReason::kNewerAvailable);
  while (bytes() > kBytesMax) drop_group(DropReason::kQueueBytes);
  while (!waiting_.empty() && bytes_.is_full()) drop_group(DropReason::kMemory);
}

void PacketStream::drop_group(DropReason reason) {
  const StreamId stream = waiting_.front().stream;
  lose(waiting_.front(), reason);
  waiting_.pop_front();
  break_group(stream);
}

void PacketStream::break_group(const StreamId& stream) {
  bool is_whole = false;
  for (std::size_t i = 0; i < waiting_.size() && !is_whole;) {
    is_whole = waiting_[i].stream == stream && waiting_[i].is_key;
    if (is_whole || waiting_[i].stream != stream) {
      ++i;
      continue;
    }
    lose(waiting_[i], DropReason::kNewerAvailable);
    waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  if (!is_whole) groups_of(stream).lost();
}

void PacketStream::note_drops() {
  const ChannelQueue* const queue = offer_.queue();
  const std::uint64_t drops = queue ? queue->counts().dropped.total() : 0;
  if (std::exchange(drops_, drops) >= drops) return;
  for (auto& [stream, groups] : groups_) break_group(stream);
}

void PacketStream::on_lost(OriginId origin, const video::VideoPacket& packet) {
  groups_of({origin, std::string(packet.codec) += packet.frame_id}).lost();
}

void PacketStream::on_lost() {
  for (auto& [stream, groups] : groups_) groups.lost();
}

void PacketStream::lose(const Waiting& packet, DropReason reason) {
  release(packet.sample);
  offer_.lose(packet.sample, reason);
}

void PacketStream::clear(DropReason reason) {
  for (const Waiting& packet : waiting_) lose(packet, reason);
  waiting_.clear();
  groups_.clear();
  late_.cancel();
}

void PacketStream::end(OriginId origin) {
  std::erase_if(waiting_, [&](const Waiting& packet) {
    if (packet.stream.first != origin) return false;
    lose(packet, DropReason::kUnknownOrigin);
    return true;
  });
  std::erase_if(groups_, [&](const auto& entry) { return entry.first.first == origin; });
}

bool PacketStream::holds(OriginId origin) const {
  return std::any_of(waiting_.begin(), waiting_.end(),
                     [&](const Waiting& packet) { return packet.stream.first == origin; });
}

}  // namespace connect_bridge
