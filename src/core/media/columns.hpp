// A sample as columns: the elements of one kind side by side, as differences, byte by byte. So
// zstd finds in pictures and clouds what it does not see in the sample (docs/protocol.md section
// 6). One unit: for each kind of column, what is written and what is read must agree.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/result.hpp"

namespace connect_bridge::media {

enum class ColumnKind : std::uint8_t {
  kPlain = 0,  // the elements' bits
  kRanks = 1,  // ranks in a table of distinct values; the encoder makes it plain if that is larger
  kSteps = 2,  // float32 as multiples of a step: the only kind that is not exact
};

// The elements begin + row * row_stride + i * stride of a sample.
struct Column {
  std::uint32_t begin = 0;
  std::uint32_t rows = 1;
  std::uint32_t row_stride = 0;
  std::uint32_t count = 0;  // of elements in a row
  std::uint16_t stride = 1;
  ColumnKind kind = ColumnKind::kPlain;
  std::uint8_t width = 1;   // bytes of an element: 1, 2, 4, 8
  std::uint8_t planes = 0;  // bytes of an element that are stored; the encoder finds it
  std::uint8_t lag = 0;     // differences to the element so many before; 0: none
  bool big_endian = false;
  // The values of the last column without this flag are subtracted; for elements of one byte.
  bool minus = false;
  std::uint32_t extra = 0;   // kRanks: entries of the table; kSteps: micrometres
  std::uint32_t listed = 0;  // kSteps: values that no step comes near enough to

  [[nodiscard]] std::uint64_t elements() const { return std::uint64_t{rows} * count; }
  [[nodiscard]] std::uint64_t bytes() const { return elements() * width; }
};
using Columns = std::vector<Column>;

inline constexpr std::size_t kColumnsMax = 255;
inline constexpr std::uint8_t kLagMax = 128;
inline constexpr std::uint32_t kRanksMax = 4096;

// The whole sample as one column of bytes.
[[nodiscard]] Columns opaque(std::size_t raw_bytes);

// The columns must be within `raw` and have as many bytes as it has. Where a part of the sample
// shows that it shrinks more as it is, it is one opaque column. nullopt: it does not shrink, or
// `give_up` became true meanwhile, as in compress().
[[nodiscard]] std::optional<Bytes> encode_columns(ByteView raw, const Columns& columns, int level,
                                                  const std::atomic<bool>* give_up = nullptr);

enum class Steps : std::uint8_t { kRefused, kAllowed };
// Exactly `raw_bytes` bytes, or kMalformed. The caller has checked `raw_bytes` against its limit;
// no more than four times as much is allocated, and nothing before all sizes agree.
[[nodiscard]] Result<Bytes> decode_columns(ByteView body, std::size_t raw_bytes, Steps steps);

// The facts that a body states about itself; nullopt if it is malformed.
struct BodyFacts {
  std::uint64_t raw_bytes = 0;
  std::uint32_t step_um = 0;  // the coarsest; 0: exact
};
[[nodiscard]] std::optional<BodyFacts> facts_of(ByteView body);

// ---- for the choice of columns

// The elements of a column of this width, as numbers without a sign; at most `most` of them, from
// the middle.
[[nodiscard]] std::vector<std::uint32_t> some_of(ByteView raw, const Column& column,
                                                 std::size_t most);
// The multiple of the step next to a value that is not special.
[[nodiscard]] std::optional<std::int32_t> steps_of(float value, std::uint32_t step_um);

}  // namespace connect_bridge::media
