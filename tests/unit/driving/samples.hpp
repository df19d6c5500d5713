// Samples of the types that steer, as middlewares write them.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/cdr.hpp"
#include "core/base/time.hpp"

namespace connect_bridge::driving_test {

inline void write_values(CdrWriter& writer, const std::array<double, 6>& values) {
  for (const double value : values) writer.u64(std::bit_cast<std::uint64_t>(value));
}
inline Payload twist(double x, double turn = 0) {
  CdrWriter writer;
  write_values(writer, {x, 0, 0, 0, 0, turn});
  return writer.take();
}
inline Payload twist_stamped(Stamp stamp, double x, const std::string& frame = "base_link") {
  CdrWriter writer;
  writer.u32(static_cast<std::uint32_t>(stamp / kStampSecond))
      .u32(static_cast<std::uint32_t>(stamp % kStampSecond))
      .string(frame);
  write_values(writer, {x, 0, 0, 0, 0, 0});
  return writer.take();
}
inline void write_drive(CdrWriter& writer, const std::array<float, 5>& values) {
  for (const float value : values) writer.u32(std::bit_cast<std::uint32_t>(value));
}
// Angle, its speed, speed, acceleration, jerk.
inline Payload ackermann(const std::array<float, 5>& values) {
  CdrWriter writer;
  write_drive(writer, values);
  return writer.take();
}
inline Payload ackermann_stamped(Stamp stamp, const std::array<float, 5>& values) {
  CdrWriter writer;
  writer.u32(static_cast<std::uint32_t>(stamp / kStampSecond))
      .u32(static_cast<std::uint32_t>(stamp % kStampSecond))
      .string("car");
  write_drive(writer, values);
  return writer.take();
}
inline Bytes bytes_of(const Payload& payload) {
  return {payload.view().begin(), payload.view().end()};
}

}  // namespace connect_bridge::driving_test
