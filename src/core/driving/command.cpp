#include "core/driving/command.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/cdr.hpp"

namespace connect_bridge::driving {
namespace {

constexpr double kNeutral = 1e-3;
constexpr std::size_t kTwistValues = 6;      // linear and angular, as doubles
constexpr std::size_t kAckermannValues = 5;  // angle, its speed, speed, acceleration, jerk: floats
constexpr std::size_t kSpeedIndex = 2;
constexpr std::int64_t kSecondsMax = std::numeric_limits<std::int32_t>::max();

bool is_stamped(CommandType type) {
  return type == CommandType::kTwistStamped || type == CommandType::kAckermannStamped;
}
bool is_twist(CommandType type) {
  return type == CommandType::kTwist || type == CommandType::kTwistStamped;
}
std::size_t value_bytes(CommandType type) {
  return is_twist(type) ? sizeof(double) : sizeof(float);
}

template <class T>
T get(ByteView bytes, std::size_t at, bool big_endian) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    value |= static_cast<T>(T{bytes[at + i]} << 8U * (big_endian ? sizeof(T) - 1 - i : i));
  return value;
}

void put(Bytes& bytes, std::size_t at, std::uint32_t value, bool big_endian) {
  for (std::size_t i = 0; i < sizeof value; ++i)
    bytes[at + i] = static_cast<std::uint8_t>(value >> 8U * (big_endian ? 3 - i : i));
}

// The places of the fields of a sample.
struct Layout {
  bool big_endian = false;
  std::size_t values = 0;  // the first of the numbers
};

// nullopt: the sample is not exactly the plain CDR of the type, to the last byte.
std::optional<Layout> layout_of(CommandType type, ByteView sample) {
  if (sample.size() < kCdrHeaderBytes || sample[0] != 0 || sample[1] > 1) return std::nullopt;
  const bool big_endian = sample[1] == 0;
  std::size_t at = kCdrHeaderBytes;
  if (is_stamped(type)) {
    constexpr std::size_t kStampBytes = 8, kLengthBytes = 4;
    at += kStampBytes;
    if (sample.size() < at + kLengthBytes) return std::nullopt;
    const std::size_t length = get<std::uint32_t>(sample, at, big_endian);
    at += kLengthBytes;
    if (length == 0 || length > sample.size() - at || sample[at + length - 1] != 0)
      return std::nullopt;
    at += length;
  }
  const std::size_t size = value_bytes(type);
  at += (size - (at - kCdrHeaderBytes) % size) % size;
  const std::size_t count = is_twist(type) ? kTwistValues : kAckermannValues;
  if (sample.size() != at + count * size) return std::nullopt;  // mutant: command_whole
  return Layout{big_endian, at};
}

// A value that is no number is not neutral.
bool is_neutral(double value) {
  return std::abs(value) < kNeutral;
}

bool moves(CommandType type, ByteView sample, const Layout& layout) {
  if (!is_twist(type)) {
    const auto bits =
        get<std::uint32_t>(sample, layout.values + kSpeedIndex * sizeof(float), layout.big_endian);
    return !is_neutral(std::bit_cast<float>(bits));
  }
  for (std::size_t i = 0; i < kTwistValues; ++i) {
    const auto bits =
        get<std::uint64_t>(sample, layout.values + i * sizeof(double), layout.big_endian);
    if (!is_neutral(std::bit_cast<double>(bits))) return true;
  }
  return false;
}

Bytes empty_command(CommandType type) {
  CdrWriter writer;
  if (is_stamped(type)) writer.u32(0).u32(0).string("");
  for (std::size_t i = 0; is_twist(type) && i < kTwistValues; ++i) writer.u64(0);
  for (std::size_t i = 0; !is_twist(type) && i < kAckermannValues; ++i) writer.u32(0);
  const Payload written = writer.take();
  return {written.view().begin(), written.view().end()};
}

}  // namespace

std::optional<CommandType> command_type(std::string_view type) {
  constexpr std::array<std::pair<std::string_view, CommandType>, 4> kTypes{{
      {"geometry_msgs/msg/Twist", CommandType::kTwist},
      {"geometry_msgs/msg/TwistStamped", CommandType::kTwistStamped},
      {"ackermann_msgs/msg/AckermannDrive", CommandType::kAckermann},
      {"ackermann_msgs/msg/AckermannDriveStamped", CommandType::kAckermannStamped},
  }};
  for (const auto& [name, command] : kTypes)
    if (name == type) return command;
  return std::nullopt;
}

Command read_command(CommandType type, ByteView sample) {
  const auto layout = layout_of(type, sample);
  if (!layout) return {};
  const std::size_t at = is_stamped(type) ? kCdrHeaderBytes : 0;
  return {true, moves(type, sample, *layout), {at, layout->big_endian}};
}

std::optional<Stamp> stamp_of(ByteView sample, const StampField& field) {
  const auto seconds = get<std::uint32_t>(sample, field.at, field.big_endian);
  const auto rest = get<std::uint32_t>(sample, field.at + 4, field.big_endian);
  if (seconds > kSecondsMax || rest >= kStampSecond) return std::nullopt;
  return Stamp{seconds} * kStampSecond + rest;
}

void write_stamp(Bytes& sample, const StampField& field, Stamp stamp) {
  const Stamp kept = std::clamp<Stamp>(stamp, 0, kSecondsMax * kStampSecond);
  put(sample, field.at, static_cast<std::uint32_t>(kept / kStampSecond), field.big_endian);
  put(sample, field.at + 4, static_cast<std::uint32_t>(kept % kStampSecond), field.big_endian);
}

Payload halt_after(CommandType type, ByteView last, Stamp now) {
  auto layout = layout_of(type, last);
  Bytes zero = layout ? Bytes(last.begin(), last.end()) : empty_command(type);
  if (!layout) layout = layout_of(type, zero);
  // Without an acceleration and a jerk an Ackermann car stops as fast as it can.
  const std::size_t kept = is_twist(type) ? 0 : kSpeedIndex;
  const auto first = static_cast<std::ptrdiff_t>(layout->values + kept * value_bytes(type));
  std::fill(zero.begin() + first, zero.end(), std::uint8_t{0});
  if (is_stamped(type)) write_stamp(zero, {kCdrHeaderBytes, layout->big_endian}, now);
  return Payload::adopt(std::move(zero));
}

}  // namespace connect_bridge::driving
