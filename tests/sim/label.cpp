#include "sim/label.hpp"

#include <cstring>

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

}  // namespace

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
  if (message.size() < kLabelBytes || get<std::uint32_t>(message, 4) != kMagic) return {};
  return Label{get<std::uint32_t>(message, 8), get<std::uint64_t>(message, 16)};
}

bool is_intact(ByteView message) {
  return read_label(message) && get<std::uint32_t>(message, 12) == message.size() &&
         get<std::uint64_t>(message, 24) == checksum(message);
}

}  // namespace connect_bridge::sim
