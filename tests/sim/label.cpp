#include "sim/label.hpp"

#include <algorithm>
#include <cstring>
#include <string_view>

#include "core/base/byte_order.hpp"
#include "core/media/layouts.hpp"

namespace connect_bridge::sim {
namespace {

constexpr std::uint32_t kMagic = 0x51AB0E55;

// encapsulation (4) | magic (4) | writer (4) | size (4) | counter (8) | checksum (8) | filler
template <class T>
void put(Bytes& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

template <class T>
T get(ByteView bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

std::uint64_t checksum(ByteView bytes) {
  std::uint64_t sum = 0x9e3779b97f4a7c15ULL ^ bytes.size();
  const auto mix = [&sum](std::uint64_t word) {
    sum = (sum ^ word) * 0xbf58476d1ce4e5b9ULL;
    sum ^= sum >> 29;
  };
  std::size_t at = 0;
  for (; at + 8 <= bytes.size(); at += 8) {
    if (at != 24) mix(get<std::uint64_t>(bytes, at));  // the checksum's own place
  }
  for (; at < bytes.size(); ++at) mix(bytes[at]);
  return sum;
}

constexpr std::uint32_t kImageWidth = 32;
constexpr std::uint32_t kImageStep = 3 * kImageWidth;

// The labelled part of a message: the data of an Image, or all of it.
ByteView labelled(ByteView message) {
  if (message.size() >= kLabelBytes && get<std::uint32_t>(message, 4) == kMagic) return message;
  const auto image = media::image_layout(message);
  return image ? message.subspan(image->data.begin, image->data.bytes) : message;
}

}  // namespace

Bytes make_image(const Label& label, std::size_t size, bool compressible) {
  const auto height = std::max(kImageWidth, static_cast<std::uint32_t>(size / kImageStep));
  Bytes prefix{0, 1, 0, 0};
  const auto add = [&](std::uint32_t value) { put_le(value, prefix); };
  const auto add_text = [&](std::string_view text) {  // of three characters and a zero
    add(static_cast<std::uint32_t>(text.size() + 1));
    prefix.insert(prefix.end(), text.begin(), text.end());
    prefix.push_back(0);
    while (prefix.size() % 4 != 0) prefix.push_back(0);
  };
  add(0);
  add(0);
  add_text("cam");
  add(height);
  add(kImageWidth);
  add_text("rgb8");
  prefix.resize(prefix.size() - 3);  // is_bigendian follows the encoding at once
  prefix.push_back(0);
  while (prefix.size() % 4 != 0) prefix.push_back(0);
  add(kImageStep);
  add(height * kImageStep);
  return image_of(label, prefix, std::size_t{height} * kImageStep, compressible);
}

Bytes image_of(const Label& label, ByteView prefix, std::size_t data_bytes, bool compressible) {
  Bytes image(prefix.begin(), prefix.end());
  const Bytes data = make_message(label, data_bytes, compressible);
  image.insert(image.end(), data.begin(), data.end());
  return image;
}

bool is_compressible(ByteView message) {
  const ByteView bytes = labelled(message);
  return bytes.size() < kLabelBytes + 16 ||
         get<std::uint64_t>(bytes, kLabelBytes) == get<std::uint64_t>(bytes, kLabelBytes + 8);
}

Bytes make_message(const Label& label, std::size_t size, bool compressible) {
  Bytes bytes(size < kLabelBytes ? kLabelBytes : size);
  bytes[1] = 1;  // CDR, little-endian
  put(bytes, 4, kMagic);
  put(bytes, 8, label.writer);
  put(bytes, 12, static_cast<std::uint32_t>(bytes.size()));
  put(bytes, 16, label.counter);
  std::uint64_t filler = label.counter * 0x94d049bb133111ebULL + label.writer;
  std::size_t at = kLabelBytes;
  for (; at + 8 <= bytes.size(); at += 8) {
    if (!compressible) filler = filler * 6364136223846793005ULL + 1442695040888963407ULL;
    put(bytes, at, filler ^ (filler >> 31));
  }
  put(bytes, 24, checksum(bytes));
  return bytes;
}

std::optional<Label> read_label(ByteView message) {
  const ByteView bytes = labelled(message);
  if (bytes.size() < kLabelBytes || get<std::uint32_t>(bytes, 4) != kMagic) return {};
  return Label{get<std::uint32_t>(bytes, 8), get<std::uint64_t>(bytes, 16)};
}

bool is_intact(ByteView message) {
  const ByteView bytes = labelled(message);
  return read_label(message) && get<std::uint32_t>(bytes, 12) == bytes.size() &&
         get<std::uint64_t>(bytes, 24) == checksum(bytes);
}

}  // namespace connect_bridge::sim
