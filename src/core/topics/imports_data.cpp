// The way of a message from a link to the local graph: checked, decompressed in order, published.
#include <algorithm>

#include "core/compress/compress.hpp"
#include "core/link/options.hpp"
#include "core/topics/imports.hpp"

namespace connect_bridge {
namespace {

// What the channels of a link together may hold for decompression.
constexpr std::uint64_t kDecodingBytesMax = 64 << 20;

// A serialized sample begins with its encapsulation (RTPS 2.3 section 10.2): a known representation
// identifier in two bytes, then two bytes of options.
bool is_serialized(ByteView raw) {
  return raw.size() >= 4 && raw[0] == 0 && raw[1] <= 0x0b;
}

}  // namespace

std::optional<Result<Nothing>> Imports::on_message(Link& link, InMessage& message, const Now& now) {
  const ChannelKey key{link.id, message.channel};
  const auto it = channels_.find(key);
  if (it == channels_.end()) return std::nullopt;
  Channel& channel = it->second;
  channel.wire_bytes += message.body.size();
  if (!channel.demanded) {
    channel.dropped.add(DropReason::kNoDemand);
    return Nothing{};
  }
  return decode(link, key, channel, std::move(message), now);
}

Result<Nothing> Imports::decode(Link& link, const ChannelKey& key, Channel& channel,
                                InMessage message, const Now& now) {
  const bool large = message.raw_bytes >= options_.compress_job_bytes;
  if (channel.decoding.empty() && message.codec == Codec::kNone) {
    publish(link, channel, message, message.body, now);
    return Nothing{};
  }
  if (channel.decoding.empty() && !large) {
    auto raw = decompress(message.body.view(), message.codec, message.raw_bytes);
    if (!raw) return raw.error();
    publish(link, channel, message, Payload::adopt(std::move(raw).value()), now);
    return Nothing{};
  }
  if (decoding_by_link_[link.id] + message.body.size() > kDecodingBytesMax) {
    channel.dropped.add(DropReason::kQueueBytes);
    return Nothing{};
  }
  // A message of one part is a slice: it must not keep its whole packet while it waits.
  if (message.body.size() <= kPacketBytesMax) message.body = Payload::copy_of(message.body.view());
  count_decoding(link.id, message, true);
  channel.decoding.push_back(std::move(message));
  if (!channel.job) start_job(key, channel);
  return Nothing{};
}

void Imports::count_decoding(LinkId link, const InMessage& message, bool add) {
  auto& of_link = decoding_by_link_[link];
  if (add) {
    of_link += message.body.size();
    decoding_bytes_ += message.body.size();
    return;
  }
  decoding_bytes_ -= message.body.size();
  of_link -= message.body.size();
  if (of_link == 0) decoding_by_link_.erase(link);
}

void Imports::start_job(const ChannelKey& key, Channel& channel) {
  const InMessage& message = channel.decoding.front();
  channel.job = outputs_.new_job();
  jobs_[channel.job] = key;
  outputs_.push(DecompressJob{channel.job, message.codec, message.raw_bytes, message.body});
}

bool Imports::on_job(const JobDone& done, const Now& now) {
  const auto job = jobs_.find(done.job);
  if (job == jobs_.end()) return false;
  const ChannelKey key = job->second;
  jobs_.erase(job);
  Link& link = links_.at(key.first);
  Channel& channel = channels_.at(key);
  channel.job = {};
  if (!done.result) {
    link.fail({CloseCode::kMalformed, "a compressed message does not decompress to its size"});
    return true;
  }
  const InMessage message = std::move(channel.decoding.front());
  channel.decoding.pop_front();
  count_decoding(key.first, message, false);
  publish(link, channel, message, *done.result, now);
  advance(key, channel, now);
  return true;
}

void Imports::advance(const ChannelKey& key, Channel& channel, const Now& now) {
  while (!channel.decoding.empty() && !channel.job) {
    if (channel.decoding.front().codec != Codec::kNone) return start_job(key, channel);
    const InMessage message = std::move(channel.decoding.front());
    channel.decoding.pop_front();
    count_decoding(key.first, message, false);
    publish(links_.at(key.first), channel, message, message.body, now);
  }
}

void Imports::publish(Link& link, Channel& channel, const InMessage& message, const Payload& raw,
                      const Now& now) {
  const auto origin = channel.origins.find(message.origin);
  if (origin == channel.origins.end()) return channel.dropped.add(DropReason::kUnknownOrigin);
  Mirror& mirror = *origin->second;
  if (!mirror.id) return channel.dropped.add(DropReason::kNoDemand);
  // Another link feeds this mirror.
  if (mirror.candidates.front().link != link.id) return channel.dropped.add(DropReason::kDuplicate);
  if (!is_serialized(raw.view())) return channel.dropped.add(DropReason::kPublishFailed);
  const ClockEstimate* clock = link.connection ? &link.connection->clock() : nullptr;
  if (clock && clock->known() && is_plausible(message.stamp)) {
    const Duration age(now.system - (message.stamp - clock->offset().count()));
    if (age > channel.decision.treatment.max_age) return channel.dropped.add(DropReason::kMaxAge);
    channel.latency_ms = static_cast<double>(age.count()) / 1e6;
  }
  // After a reconnect, or when demand returns, the exporter sends the last samples of a
  // transient-local origin again (whatever the mirror's own QoS); and when another link takes over
  // as the feeding one, it may be behind the first.
  const bool repeats =
      mirror.origin.qos.durability == Durability::kTransientLocal || mirror.fed_by != link.id;
  if (repeats && message.stamp != 0 && message.stamp <= mirror.last_stamp) {
    return channel.dropped.add(DropReason::kDuplicate);
  }
  mirror.last_stamp = std::max(mirror.last_stamp, message.stamp);
  mirror.fed_by = link.id;
  ++channel.published;
  channel.bytes += raw.size();
  outputs_.push(Publish{mirror.id, raw});
}

// What was counted as published turns out to be a drop.
void Imports::on_publish_failed(const PublishFailed& failed) {
  for (const auto& [key, mirror] : mirrors_) {
    if (mirror.id != failed.mirror || mirror.candidates.empty()) continue;
    const Candidate& feeder = mirror.candidates.front();
    const auto channel = channels_.find({feeder.link, feeder.channel});
    if (channel == channels_.end()) return;
    // A channel that is younger than the message has not counted it.
    const auto count = std::min(failed.count, channel->second.published);
    channel->second.published -= count;
    channel->second.dropped.add(DropReason::kPublishFailed, count);
    return;
  }
}

void Imports::add_status(const Link& link, LinkStatus& status) const {
  for (auto it = channels_.lower_bound({link.id, ChannelId{}});
       it != channels_.end() && it->first.first == link.id; ++it) {
    const Channel& channel = it->second;
    if (channel.declined) continue;
    TopicStatus s;
    s.topic = channel.key.first;
    s.type = channel.key.second;
    s.demanded = channel.demanded;
    s.origins = static_cast<std::uint32_t>(channel.origins.size());
    s.messages = channel.published;
    s.bytes = channel.bytes;
    s.wire_bytes = channel.wire_bytes;
    s.queued = channel.decoding.size();
    s.latency_ms = channel.latency_ms;
    s.dropped = channel.dropped;
    status.topics.push_back(std::move(s));
  }
}

}  // namespace connect_bridge
