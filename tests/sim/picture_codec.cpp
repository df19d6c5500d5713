#include "sim/picture_codec.hpp"

#include <algorithm>
#include <cstring>

#include "core/base/byte_order.hpp"
#include "core/video/body.hpp"
#include "sim/label.hpp"
#include "sim/schedule.hpp"

namespace connect_bridge::sim {
namespace {

constexpr std::uint8_t kQuantiser = 40;
constexpr std::size_t kKeyHeadBytes = 10;
constexpr std::size_t kDeltaHeadBytes = 3;
constexpr std::uint64_t kPrime = 0x100000001b3;

// The uncompressed head of a VP8 frame (RFC 6386 section 9.1), which the bridge reads.
Bytes head_of(bool base, video::Size size) {
  Bytes head(base ? kKeyHeadBytes : kDeltaHeadBytes);
  head[0] = base ? 0x10 : 0x11;  // shown, version 0
  if (!base) return head;
  head[3] = 0x9d;
  head[4] = 0x01;
  head[5] = 0x2a;
  head[6] = static_cast<std::uint8_t>(size.width);
  head[7] = static_cast<std::uint8_t>(size.width >> 8U);
  head[8] = static_cast<std::uint8_t>(size.height);
  head[9] = static_cast<std::uint8_t>(size.height >> 8U);
  return head;
}

std::uint64_t next_hash(std::uint64_t before, const Label& label) {
  return (before ^ label.counter * kPrime ^ label.writer) * kPrime + 1;
}

}  // namespace

// Behind the head: the hash of the frame before, the label, and whether the sample's filler is
// compressible.
std::optional<Bytes> PictureCodec::encode(const EncodePicture& job) {
  if (ended_.contains(job.picture)) return std::nullopt;
  const auto sample = video::read_sample(job.raw.view());
  const auto label = sample ? read_label(job.raw.view()) : std::nullopt;
  if (!label) return std::nullopt;
  const auto known = last_.find(job.picture);
  const bool base = job.base || known == last_.end();
  const std::uint64_t before = base ? 0 : known->second;
  last_[job.picture] = next_hash(before, *label);
  Bytes frame = head_of(base, sample->shape.coded(false));
  put_le(before, frame);
  put_le(label->counter, frame);
  put_le(label->writer, frame);
  frame.push_back(is_compressible(job.raw.view()) ? 1 : 0);
  const std::size_t rest = video::kBodyHeadBytes + sample->prefix.size();
  const std::size_t wanted = std::min<std::size_t>(job.bytes, job.raw.size());
  frame.resize(std::max(frame.size(), wanted > rest ? wanted - rest : 0));
  video::PictureBody body;
  body.base = base;
  body.quantiser = kQuantiser;
  body.prefix = sample->prefix;
  body.frame = frame;
  return video::write_body(body);
}

std::optional<Bytes> PictureCodec::decode(const DecodePicture& job) {
  if (ended_.contains(job.picture)) return std::nullopt;
  const auto body = video::read_body(job.body.view());
  if (!body || body->raw_bytes() != job.raw_bytes) return std::nullopt;
  const std::size_t at = body->base ? kKeyHeadBytes : kDeltaHeadBytes;
  if (body->frame.size() < at + 21) return std::nullopt;
  const auto before = get_le<std::uint64_t>(body->frame, at);
  const Label label{get_le<std::uint32_t>(body->frame, at + 16),
                    get_le<std::uint64_t>(body->frame, at + 8)};
  const auto known = last_.find(job.picture);
  if (!body->base && (known == last_.end() || known->second != before))
    violated("a picture refers to another one than the last that was decoded");
  last_[job.picture] = next_hash(before, label);
  return image_of(label, body->prefix, body->shape.data_bytes(), body->frame[at + 20] != 0);
}

}  // namespace connect_bridge::sim
