#include "core/topics/topic_streams.hpp"

#include <algorithm>
#include <utility>

#include "core/flow/delta_encoder.hpp"

namespace connect_bridge {
namespace {

constexpr std::uint64_t kEncoderBytesMax = 4 << 20;  // of samples that wait for a worker
// Bytes per second; below, zstd's third level is the better one, above it its first.
constexpr double kThinRate = 4e6;
constexpr double kSlackMax = 0.1;    // then it is asked again
constexpr double kSlackMin = 0.005;  // a queue that stands still must not keep the loop busy
constexpr double kDecompressSecondsPerByte = 2e-9;

}  // namespace

Compression TopicStreams::way_to(const TopicOffer& offer, LinkId link, std::size_t bytes) {
  // A sample must not overtake one that is being compressed.
  for (const auto& [how, stream] : streams_)
    if (stream.encoder.holds(link)) return how;  // mutant: compressed_in_order
  const Compression& rule = offer.treatment().compression;
  // The link's queue compresses small samples, against the base that this peer has.
  const bool small = !context_.jobs.is_large(bytes) && bytes <= DeltaEncoder::kBytesMax;
  if (rule.codec == Codec::kZstd && small) return {};
  if (!rule.automatic) return rule;
  const double rate = offer.path_rate();
  if (small || rate == 0) return {};
  const Compression how{Codec::kZstd, rate < kThinRate ? 3 : 1, true};
  Stream& stream = stream_of(how);
  const double cost = stream.seconds_per_byte * static_cast<double>(bytes);
  return stream.gain.pays(bytes, rate, cost) ? how : Compression{};
}

TopicStreams::Stream& TopicStreams::stream_of(const Compression& how) {
  const auto stream = streams_.find(how);
  if (stream != streams_.end()) return stream->second;
  // Of a transient-local topic each origin's last samples must get through, and they come at once.
  const bool latched = qos_.durability == Durability::kTransientLocal;
  const std::uint32_t depth = latched ? 0 : qos_.depth;
  const auto bytes =
      latched ? std::max(context_.options.history_bytes_max, kEncoderBytesMax) : kEncoderBytesMax;
  return streams_.try_emplace(how, *this, Encoder::Options{how, depth, bytes}).first->second;
}

void TopicStreams::encode(const Compression& how, OutSample sample, const Now& now) {
  Stream& stream = stream_of(how);
  stream.chosen = stream.chosen || stream.encoder.bytes() == 0;
  for (const auto& displaced : stream.encoder.push(std::move(sample)))
    drop(displaced.sample, displaced.reason);
  send_encoded(stream, now);
}

// The time at work includes that behind other jobs: it is what the message waits for.
void TopicStreams::Stream::on_job(std::optional<Payload> result, const Now& now) {
  const auto bytes = static_cast<double>(encoder.bytes_at_work());
  if (result) {
    gain.note(static_cast<double>(result->size()) / bytes);
  } else {
    gain.note_in_vain();
  }
  const double took = std::chrono::duration<double>(now.steady - begun).count();
  // One slow job, while others took the workers, says little: the mean moves by a quarter.
  const double latest = took / bytes + kDecompressSecondsPerByte;
  seconds_per_byte += (latest - seconds_per_byte) / 4;
  encoder.finish(std::move(result));
  streams.send_encoded(*this, now);
}

void TopicStreams::send_encoded(Stream& stream, const Now& now) {
  // In the order of the samples, until one must wait: what was only in line behind others, and
  // would not be compressed by itself, passes; a large one waits while its links have enough to
  // send; else it is compressed, at once or by a worker, whose result calls this again.
  const bool at_work = stream.encoder.bytes_at_work() > 0;
  stream.later.cancel();
  for (;;) {
    if (passes(stream)) {
      send(stream.encoder.pass(), now);
      continue;
    }
    const Duration slack = slack_of(stream);
    if (slack > Duration::zero()) {
      stream.later = context_.timers.set(now.steady + slack, &topic_);
      break;
    }
    if (stream.encoder.upcoming()) stream.chosen = false;
    const auto ready = stream.encoder.next();
    if (!ready) break;
    send(*ready, now);
  }
  // If a worker has begun just now, its time counts from here (on_job).
  if (!at_work) stream.begun = now.steady;
}

void TopicStreams::send(const Encoder::Encoded& ready, const Now& now) {
  for (const LinkId link : ready.sample.targets)
    if (const auto offer = offers_.find(link); offer != offers_.end())
      offer->second.send(ready.sample, ready.codec, ready.body, now);
}

// Otherwise a topic that fills its link would never stop using a compression that does not pay.
bool TopicStreams::passes(const Stream& stream) const {
  const OutSample* next = stream.automatic && !stream.chosen ? stream.encoder.upcoming() : nullptr;
  if (!next) return false;
  const std::size_t bytes = next->raw.size();
  const double cost = stream.seconds_per_byte * static_cast<double>(bytes);
  return std::none_of(next->targets.begin(), next->targets.end(), [&](LinkId link) {
    const auto offer = offers_.find(link);
    return offer != offers_.end() &&
           stream.gain.likely_pays(bytes, offer->second.path_rate(), cost);
  });
}

// What a path cannot carry is displaced by newer samples: better before it has cost a worker's time
// than after. So a sample waits until the first of its links has nearly sent what it has.
Duration TopicStreams::slack_of(const Stream& stream) const {
  const OutSample* next = stream.automatic ? stream.encoder.upcoming() : nullptr;
  if (!next || !context_.jobs.is_large(next->raw.size())) return {};
  double busy = kSlackMax;
  for (const LinkId link : next->targets) {
    const auto offer = offers_.find(link);
    busy = std::min(busy, offer == offers_.end() ? 0 : offer->second.queue_seconds());
  }
  const double takes = stream.seconds_per_byte * static_cast<double>(next->raw.size());
  const double slack = busy - 2 * takes;
  if (slack < kSlackMin) return {};
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(slack));
}

void TopicStreams::on_time(const Now& now) {
  for (auto& [how, stream] : streams_)
    if (stream.later && stream.later.at() <= now.steady) send_encoded(stream, now);
}

// The sample that a worker has for the link would be sent in its next demand before the last
// samples, and may be one of them.
std::vector<OutSample> TopicStreams::forget(LinkId link) {
  std::vector<OutSample> forgotten;  // all of one stream, see way_to()
  for (auto& [how, stream] : streams_)
    for (auto& sample : stream.encoder.forget(link)) forgotten.push_back(std::move(sample));
  return forgotten;
}

void TopicStreams::clear() {
  for (auto& [how, stream] : streams_)
    for (const auto& sample : stream.encoder.clear()) drop(sample, DropReason::kNoDemand);
}

void TopicStreams::drop(const OutSample& sample, DropReason reason) {
  for (const LinkId link : sample.targets)
    if (const auto offer = offers_.find(link); offer != offers_.end()) offer->second.drop(reason);
}

std::uint64_t TopicStreams::bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [how, stream] : streams_) bytes += stream.encoder.bytes();
  return bytes;
}

}  // namespace connect_bridge
