// The four types that steer a robot by speed: the content of their samples, and a zero for a halt.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/bytes.hpp"
#include "core/base/time.hpp"

namespace connect_bridge::driving {

enum class CommandType : std::uint8_t { kTwist, kTwistStamped, kAckermann, kAckermannStamped };

// nullopt: the type does not steer by speed. Of a Joy nobody knows which values are neutral.
[[nodiscard]] std::optional<CommandType> command_type(std::string_view type);

// The place of a stamp in a sample: seconds, then nanoseconds.
struct StampField {
  std::size_t at = 0;  // 0: the sample has no stamp
  bool big_endian = false;
};

struct Command {
  // False for bytes that are not exactly plain CDR of the type: such a sample counts as one that
  // moves, and nothing of it is changed.
  bool readable = false;
  // A Twist is neutral if its six values are below 1e-3, an AckermannDrive if its speed is.
  bool moves = true;
  StampField stamp;
};
[[nodiscard]] Command read_command(CommandType type, ByteView sample);

// The stamp at this place, in ns. nullopt: it is negative, or its nanoseconds are too many.
[[nodiscard]] std::optional<Stamp> stamp_of(ByteView sample, const StampField& field);
void write_stamp(Bytes& sample, const StampField& field, Stamp stamp);

// A command that stops, made from the last one: it has the frame of that one, and the angle of its
// wheels. `now` becomes its stamp.
[[nodiscard]] Payload halt_after(CommandType type, ByteView last, Stamp now);

}  // namespace connect_bridge::driving
