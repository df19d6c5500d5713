#include "core/media/cloud.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "core/base/byte_order.hpp"
#include "core/media/layouts.hpp"

namespace connect_bridge::media {
namespace {

constexpr std::size_t kTriedForLag = 1024;
constexpr std::size_t kTriedForDifference = 2048;

bool is_coordinate(const CloudField& field) {
  return field.datatype == kFloat32 && field.count == 1 &&
         (field.name == "x" || field.name == "y" || field.name == "z");
}

bool is_colour(const CloudField& field) {
  return field.name == "rgb" || field.name == "rgba";
}

// ---- columns of the fields

class PointColumns {
 public:
  explicit PointColumns(const CloudLayout& cloud) : cloud_(cloud), named_(cloud.point_step) {}

  // False: a byte belongs to two fields.
  bool add(const CloudField& field, std::uint32_t step_um) {
    const std::uint32_t size = bytes_of_datatype(field.datatype);
    for (std::uint32_t i = 0; i < field.count; ++i) {
      const std::uint32_t at = field.offset + i * size;
      for (std::uint32_t byte = at; byte < at + size; ++byte)
        if (std::exchange(named_[byte], 1) != 0) return false;
      if (is_colour(field)) {
        for (std::uint32_t byte = at; byte < at + size; ++byte) add(byte, 1);
        continue;
      }
      Column& column = add(at, static_cast<std::uint8_t>(size));
      if (field.datatype == kFloat32) column.kind = ColumnKind::kRanks;
      if (!is_coordinate(field)) continue;
      coordinates_.push_back(columns_.size() - 1);
      if (step_um == 0) continue;
      column.kind = ColumnKind::kSteps;
      column.extra = step_um;
    }
    return columns_.size() < kColumnsMax;
  }
  void add_unnamed() {
    for (std::uint32_t at = 0; at < cloud_.point_step && columns_.size() < kColumnsMax;) {
      std::uint32_t end = at;
      while (end < cloud_.point_step && named_[end] == 0 && end - at < 8) ++end;
      const std::uint32_t width = std::bit_floor(end - at);
      if (width > 0) add(at, static_cast<std::uint8_t>(width));
      at += std::max(width, 1U);
    }
  }
  [[nodiscard]] Columns& columns() { return columns_; }
  [[nodiscard]] const std::vector<std::size_t>& coordinates() const { return coordinates_; }

 private:
  Column& add(std::uint32_t offset, std::uint8_t width) {
    Column column;
    column.begin = cloud_.data.begin + offset;
    column.count = cloud_.points();
    column.stride = static_cast<std::uint16_t>(cloud_.point_step);
    column.width = width;
    column.lag = 1;
    columns_.push_back(column);
    return columns_.back();
  }

  const CloudLayout& cloud_;
  Bytes named_;  // of each byte of a point: 1 if it belongs to a field
  Columns columns_;
  std::vector<std::size_t> coordinates_;
};

// ---- the lag: points of one firing are neighbours in the sample, but not in the world

std::vector<std::uint32_t> tried(ByteView raw, const Column& column, std::size_t most) {
  auto values = some_of(raw, column, most);
  if (column.kind != ColumnKind::kSteps) return values;
  for (std::uint32_t& value : values)
    value =
        static_cast<std::uint32_t>(steps_of(std::bit_cast<float>(value), column.extra).value_or(0));
  return values;
}

std::uint32_t folded(std::uint32_t difference) {
  return (difference << 1) ^ (0U - (difference >> 31));
}

// Bits of the differences behind the longest lag, so that each lag has as many.
std::uint64_t bits_at(const std::vector<std::uint32_t>& values, std::size_t lag) {
  std::uint64_t bits = 0;
  for (std::size_t i = kLagMax; i < values.size(); ++i)
    bits += static_cast<std::uint64_t>(std::bit_width(folded(values[i] - values[i - lag])));
  return bits;
}

std::uint8_t best_lag(ByteView raw, const Columns& columns,
                      const std::vector<std::size_t>& coordinates) {
  std::array<std::uint64_t, kLagMax + 1> bits{};
  for (const std::size_t index : coordinates) {
    const auto values = tried(raw, columns[index], kTriedForLag);
    for (std::size_t lag = 1; lag <= kLagMax; ++lag) bits[lag] += bits_at(values, lag);
  }
  return static_cast<std::uint8_t>(std::min_element(bits.begin() + 1, bits.end()) - bits.begin());
}

// Bits that the bytes of the differences take, each plane by itself.
double entropy_at(const std::vector<std::uint32_t>& values, std::size_t lag, int width) {
  double bits = 0;
  for (int plane = 0; plane < std::min(width, 4); ++plane) {
    std::array<std::uint32_t, 256> counts{};
    for (std::size_t i = lag; i < values.size(); ++i) {
      const std::uint32_t code = lag == 0     ? values[i]
                                 : width == 1 ? values[i] - values[i - lag]
                                              : folded(values[i] - values[i - lag]);
      ++counts[(code >> (8 * plane)) & 0xff];
    }
    const auto all = static_cast<double>(values.size() - lag);
    for (const std::uint32_t count : counts)
      if (count > 0) bits -= std::log2(count / all) * count / all;
  }
  return bits;
}

void choose_lag(ByteView raw, Column& column, std::uint8_t best) {
  auto values = some_of(raw, column, kTriedForDifference);
  if (values.size() <= kLagMax) return;
  if (column.kind == ColumnKind::kRanks) {  // what is stored, if they are few enough
    auto sorted = values;
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    if (2 * sorted.size() <= values.size())
      for (std::uint32_t& value : values)
        value = static_cast<std::uint32_t>(std::lower_bound(sorted.begin(), sorted.end(), value) -
                                           sorted.begin());
  }
  double least = std::numeric_limits<double>::max();
  for (const std::uint8_t lag : {std::uint8_t{0}, std::uint8_t{1}, best}) {
    const double bits = entropy_at(values, lag, column.width);
    if (bits < least) column.lag = lag;
    least = std::min(least, bits);
  }
}

// ---- the grid

// The cells that have a point.
class Cells {
 public:
  explicit Cells(std::size_t points) : slots_(std::bit_ceil(2 * points + 1), kFree) {}
  // False: it was there.
  bool add(std::uint64_t cell) {
    constexpr std::uint64_t kMultiplier = 0x9e3779b97f4a7c15;  // of 2^64, as in Knuth
    const int shift = 64 - static_cast<int>(std::bit_width(slots_.size() - 1));
    std::size_t slot = (cell * kMultiplier) >> shift;
    while (slots_[slot] != kFree && slots_[slot] != cell) slot = (slot + 1) % slots_.size();
    return std::exchange(slots_[slot], cell) == kFree;
  }

 private:
  static constexpr std::uint64_t kFree = ~std::uint64_t{0};
  std::vector<std::uint64_t> slots_;
};

// The three numbers of a cell side by side. nullopt: it is too far away to have one.
std::optional<std::uint64_t> cell_of(const std::array<float, 3>& point, double grid) {
  constexpr double kCellsMax = 1 << 20;
  std::uint64_t cell = 0;
  for (const float value : point) {
    const double index = std::floor(value / grid);
    if (!(std::abs(index) < kCellsMax)) return std::nullopt;
    cell = cell << 21 | static_cast<std::uint64_t>(static_cast<std::int64_t>(index + kCellsMax));
  }
  return cell;
}

std::optional<std::array<std::uint32_t, 3>> coordinates_of(const CloudLayout& cloud) {
  std::array<std::uint32_t, 3> offsets{};
  unsigned found = 0;
  for (const CloudField& field : cloud.fields) {
    if (!is_coordinate(field)) continue;
    const auto index = static_cast<std::size_t>(field.name.front() - 'x');
    offsets[index] = field.offset;
    found |= 1U << index;
  }
  return found == 7 ? std::optional(offsets) : std::nullopt;
}

}  // namespace

std::optional<Columns> cloud_columns(ByteView raw, std::uint32_t step_um) {
  const auto cloud = cloud_layout(raw);
  if (!cloud || cloud->big_endian || cloud->point_step > std::numeric_limits<std::uint16_t>::max())
    return std::nullopt;
  // The padding of rows would look like points.
  if (!cloud->is_tight()) step_um = 0;
  PointColumns points(*cloud);
  for (const CloudField& field : cloud->fields)
    if (!points.add(field, step_um)) return std::nullopt;
  points.add_unnamed();
  Columns& columns = points.columns();
  if (columns.size() + 2 > kColumnsMax) return std::nullopt;

  const auto lag = cloud->points() > 2 * kLagMax && !points.coordinates().empty()
                       ? best_lag(raw, columns, points.coordinates())
                       : std::uint8_t{1};
  for (const std::size_t index : points.coordinates()) columns[index].lag = lag;
  for (std::size_t i = 0; i < columns.size(); ++i)
    if (std::find(points.coordinates().begin(), points.coordinates().end(), i) ==
        points.coordinates().end())
      choose_lag(raw, columns[i], lag);

  Column head;
  head.count = cloud->data.begin;
  Column tail;
  tail.begin = cloud->data.end();
  tail.count = static_cast<std::uint32_t>(raw.size()) - tail.begin;
  columns.push_back(head);
  columns.push_back(tail);
  return std::move(columns);
}

std::optional<Bytes> thinned(ByteView raw, std::uint32_t grid_um) {
  const auto cloud = cloud_layout(raw);
  if (!cloud || cloud->big_endian || !cloud->is_tight()) return std::nullopt;
  const auto offsets = coordinates_of(*cloud);
  if (!offsets) return std::nullopt;
  const double grid = grid_um / 1e6;
  Bytes thin(raw.begin(), raw.begin() + cloud->data.begin);
  thin.reserve(raw.size());
  Cells cells(cloud->points());
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < cloud->points(); ++i) {
    const ByteView point =
        raw.subspan(cloud->data.begin + std::size_t{i} * cloud->point_step, cloud->point_step);
    std::array<float, 3> at{};
    for (std::size_t axis = 0; axis < at.size(); ++axis)
      at[axis] = std::bit_cast<float>(get_le<std::uint32_t>(point, (*offsets)[axis]));
    if (!std::all_of(at.begin(), at.end(), [](float value) { return std::isfinite(value); }))
      continue;
    const auto cell = cell_of(at, grid);
    if (cell && !cells.add(*cell)) continue;
    thin.insert(thin.end(), point.begin(), point.end());
    ++kept;
  }
  set_le(std::uint32_t{1}, thin, cloud->size_at);
  set_le(kept, thin, cloud->size_at + 4);
  set_le(kept * cloud->point_step, thin, cloud->row_step_at);
  set_le(kept * cloud->point_step, thin, cloud->data.begin - 4);
  thin.insert(thin.end(), raw.begin() + cloud->data.end(), raw.end());
  thin[cloud->data.begin + std::size_t{kept} * cloud->point_step] = 1;  // is_dense
  return thin;
}

}  // namespace connect_bridge::media
