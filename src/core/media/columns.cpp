#include "core/media/columns.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/base/byte_order.hpp"
#include "core/compress/compress.hpp"

namespace connect_bridge::media {
namespace {

constexpr std::uint8_t kVersion = 1;
constexpr std::size_t kHeadBytes = 2;  // version, number of columns
constexpr std::size_t kColumnBytes = 32;
constexpr std::uint8_t kBigEndian = 1;
constexpr std::uint8_t kMinus = 2;
constexpr std::size_t kTrialBytes = 64 << 10;

// Values of kSteps that have codes of their own; the differences follow behind them.
enum Special : std::uint32_t { kListed, kNan, kMinusZero, kInfinity, kMinusInfinity, kSpecials };
constexpr std::uint32_t kNanBits = 0x7fc00000;
constexpr std::uint32_t kMinusZeroBits = 0x80000000;
constexpr std::uint32_t kInfinityBits = 0x7f800000;
constexpr std::uint32_t kMinusInfinityBits = 0xff800000;
constexpr std::uint8_t kStepPlanesMax = 3;
constexpr std::uint32_t kCodesEnd = 1U << (8 * kStepPlanesMax);
constexpr double kStepsMax = 1 << 29;  // differences fit into 31 bits

double metres(std::uint32_t step_um) {
  return step_um / 1e6;
}
float value_of(std::int32_t steps, double step) {
  return static_cast<float>(steps * step);
}

// ---- elements

template <class T>
T load(const std::uint8_t* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  if constexpr (sizeof(T) > 1 && std::endian::native == std::endian::big)
    value = get_le<T>({at, sizeof(T)}, 0);
  return value;
}
template <class T>
void store(T value, std::uint8_t* at) {
  if constexpr (sizeof(T) > 1 && std::endian::native == std::endian::big) {
    set_le(value, {at, sizeof(T)}, 0);
  } else {
    std::memcpy(at, &value, sizeof value);
  }
}
template <class T>
T swapped(T value) {
  T result = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    result = static_cast<T>(result | static_cast<T>((value >> (8 * i)) & 0xff)
                                         << (8 * (sizeof(T) - 1 - i)));
  return result;
}

template <class T>
std::vector<T> gather(ByteView raw, const Column& column) {
  std::vector<T> values(column.elements());
  T* to = values.data();
  for (std::uint32_t row = 0; row < column.rows; ++row) {
    const std::uint8_t* at = raw.data() + column.begin + std::size_t{row} * column.row_stride;
    for (std::uint32_t i = 0; i < column.count; ++i, at += column.stride) *to++ = load<T>(at);
  }
  if (column.big_endian)
    for (T& value : values) value = swapped(value);
  return values;
}

template <class T>
void scatter(std::vector<T> values, const Column& column, Bytes& raw) {
  if (column.big_endian)
    for (T& value : values) value = swapped(value);
  const T* from = values.data();
  for (std::uint32_t row = 0; row < column.rows; ++row) {
    std::uint8_t* at = raw.data() + column.begin + std::size_t{row} * column.row_stride;
    for (std::uint32_t i = 0; i < column.count; ++i, at += column.stride) store(*from++, at);
  }
}

// ---- differences: small ones of either sign become small numbers

template <class T>
T folded(T difference) {
  constexpr int kSign = 8 * sizeof(T) - 1;
  const T sign = static_cast<T>(T{0} - static_cast<T>(difference >> kSign));
  return static_cast<T>(static_cast<T>(difference << 1) ^ sign);
}
template <class T>
T unfolded(T code) {
  return static_cast<T>(static_cast<T>(code >> 1) ^ static_cast<T>(T{0} - (code & 1)));
}

// One byte keeps all its bits either way.
template <class T>
void to_differences(std::vector<T>& values, std::size_t lag) {
  if (lag == 0) return;
  for (std::size_t i = values.size(); i-- > lag;)
    values[i] = static_cast<T>(values[i] - values[i - lag]);
  if constexpr (sizeof(T) > 1)
    for (T& value : values) value = folded(value);
}
template <class T>
void from_differences(std::vector<T>& values, std::size_t lag) {
  if (lag == 0) return;
  if constexpr (sizeof(T) > 1)
    for (T& value : values) value = unfolded(value);
  for (std::size_t i = lag; i < values.size(); ++i)
    values[i] = static_cast<T>(values[i] + values[i - lag]);
}

// ---- planes

template <class T>
std::uint8_t planes_for(const std::vector<T>& values) {
  T all = 0;
  for (const T value : values) all = static_cast<T>(all | value);
  return static_cast<std::uint8_t>(std::max(1, (static_cast<int>(std::bit_width(all)) + 7) / 8));
}
template <class T>
void put_planes(const std::vector<T>& values, std::uint8_t planes, Bytes& out) {
  const std::size_t before = out.size();
  out.resize(before + values.size() * planes);
  std::uint8_t* to = out.data() + before;
  for (int plane = 0; plane < planes; ++plane)
    for (const T value : values) *to++ = static_cast<std::uint8_t>(value >> (8 * plane));
}
template <class T>
std::vector<T> take_planes(ByteView& from, std::size_t count, std::uint8_t planes) {
  std::vector<T> values(count);
  const std::uint8_t* at = from.data();
  for (int plane = 0; plane < planes; ++plane)
    for (T& value : values)
      value = static_cast<T>(value | static_cast<T>(static_cast<T>(*at++) << (8 * plane)));
  from = from.subspan(count * planes);
  return values;
}

// ---- ranks

constexpr std::size_t kSlots = 4 * kRanksMax;
constexpr std::uint16_t kFree = std::numeric_limits<std::uint16_t>::max();

// The distinct values of up to kRanksMax.
class Distinct {
 public:
  // False: one too many.
  bool add(std::uint32_t value) {
    const std::size_t slot = slot_of(value);
    if (ranks_[slot] != kFree) return true;
    if (values_.size() == kRanksMax) return false;
    ranks_[slot] = 0;
    slots_[slot] = value;
    values_.push_back(value);
    return true;
  }
  // Afterwards rank_of() answers.
  const std::vector<std::uint32_t>& sorted() {
    std::sort(values_.begin(), values_.end());
    for (std::size_t rank = 0; rank < values_.size(); ++rank)
      ranks_[slot_of(values_[rank])] = static_cast<std::uint16_t>(rank);
    return values_;
  }
  [[nodiscard]] std::uint16_t rank_of(std::uint32_t value) const { return ranks_[slot_of(value)]; }

 private:
  [[nodiscard]] std::size_t slot_of(std::uint32_t value) const {
    constexpr std::uint32_t kMultiplier = 0x9e3779b1;  // Knuth's, of 2^32
    std::size_t slot = (value * kMultiplier) >> (32 - std::bit_width(kSlots - 1));
    while (ranks_[slot] != kFree && slots_[slot] != value) slot = (slot + 1) % kSlots;
    return slot;
  }

  std::vector<std::uint32_t> slots_ = std::vector<std::uint32_t>(kSlots);
  std::vector<std::uint16_t> ranks_ = std::vector<std::uint16_t>(kSlots, kFree);
  std::vector<std::uint32_t> values_;
};

// Ranks of up to 256 values are bytes, and of more two of them.
bool are_bytes(std::uint32_t table) {
  return table <= 256;
}

template <class T>
void put_ranks(const std::vector<std::uint32_t>& values, const Distinct& distinct, Column& column,
               Bytes& out) {
  std::vector<T> ranks(values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    ranks[i] = static_cast<T>(distinct.rank_of(values[i]));
  to_differences(ranks, column.lag);
  column.planes = planes_for(ranks);
  put_planes(ranks, column.planes, out);
}

// False: too many values, or they would take more than the elements.
bool put_ranks(const std::vector<std::uint32_t>& values, Column& column, Bytes& out) {
  Distinct distinct;
  for (const std::uint32_t value : values)
    if (!distinct.add(value)) return false;
  const auto& table = distinct.sorted();
  if (2 * table.size() > values.size()) return false;
  column.extra = static_cast<std::uint32_t>(table.size());
  for (const std::uint32_t value : table) put_le(value, out);
  are_bytes(column.extra) ? put_ranks<std::uint8_t>(values, distinct, column, out)
                          : put_ranks<std::uint16_t>(values, distinct, column, out);
  return true;
}

template <class T>
bool take_ranks(const Column& column, ByteView& from, Bytes& raw) {
  std::vector<std::uint32_t> table(column.extra);
  for (std::size_t i = 0; i < table.size(); ++i) table[i] = get_le<std::uint32_t>(from, 4 * i);
  from = from.subspan(4 * table.size());
  auto ranks = take_planes<T>(from, column.elements(), column.planes);
  from_differences(ranks, column.lag);
  std::vector<std::uint32_t> values(ranks.size());
  for (std::size_t i = 0; i < ranks.size(); ++i) {
    if (ranks[i] >= table.size()) return false;
    values[i] = table[ranks[i]];
  }
  scatter(std::move(values), column, raw);
  return true;
}

// ---- steps

std::uint32_t special_of(std::uint32_t bits) {
  switch (bits) {
    case kNanBits: return kNan;
    case kMinusZeroBits: return kMinusZero;
    case kInfinityBits: return kInfinity;
    case kMinusInfinityBits: return kMinusInfinity;
    default: return kListed;
  }
}

// False: more values are listed than it could be worth.
bool put_steps(const std::vector<std::uint32_t>& values, Column& column, Bytes& out) {
  std::vector<std::uint32_t> codes(values.size());
  std::vector<std::int32_t> steps(values.size());
  std::vector<std::uint32_t> listed;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::int32_t before = i >= column.lag && column.lag > 0 ? steps[i - column.lag] : 0;
    steps[i] = before;  // as it is for the decoder, whose place a special value leaves alone
    if (values[i] != kMinusZeroBits) {
      if (const auto found = steps_of(std::bit_cast<float>(values[i]), column.extra)) {
        const auto difference = static_cast<std::uint32_t>(*found - before);
        codes[i] = folded(difference) + kSpecials;
        if (codes[i] < kCodesEnd) {
          steps[i] = *found;
          continue;
        }
      }
    }
    codes[i] = special_of(values[i]);
    if (codes[i] == kListed) listed.push_back(values[i]);
  }
  if (listed.size() > values.size() / 4) return false;
  column.listed = static_cast<std::uint32_t>(listed.size());
  column.planes = planes_for(codes);
  for (const std::uint32_t bits : listed) put_le(bits, out);
  put_planes(codes, column.planes, out);
  return true;
}

bool take_steps(const Column& column, ByteView& from, Bytes& raw) {
  const double step = metres(column.extra);
  ByteView listed = from.first(std::size_t{4} * column.listed);
  from = from.subspan(listed.size());
  auto values = take_planes<std::uint32_t>(from, column.elements(), column.planes);
  std::vector<std::int32_t> steps(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::int32_t before = i >= column.lag && column.lag > 0 ? steps[i - column.lag] : 0;
    const std::uint32_t code = values[i];
    steps[i] = before;
    switch (code) {
      case kListed:
        if (listed.empty()) return false;
        values[i] = get_le<std::uint32_t>(listed, 0);
        listed = listed.subspan(4);
        break;
      case kNan: values[i] = kNanBits; break;
      case kMinusZero: values[i] = kMinusZeroBits; break;
      case kInfinity: values[i] = kInfinityBits; break;
      case kMinusInfinity: values[i] = kMinusInfinityBits; break;
      default:
        steps[i] = static_cast<std::int32_t>(static_cast<std::uint32_t>(before) +
                                             unfolded(code - kSpecials));
        values[i] = std::bit_cast<std::uint32_t>(value_of(steps[i], step));
    }
  }
  scatter(std::move(values), column, raw);
  return listed.empty();
}

// ---- one column

// Elements of one byte, from which those of later columns can be subtracted.
using Key = std::vector<std::uint8_t>;

template <class T>
void put_plain(ByteView raw, Column& column, Key& key, Bytes& out) {
  auto values = gather<T>(raw, column);
  if constexpr (sizeof(T) == 1) {
    if (!column.minus) {
      key = values;
    } else {
      for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<std::uint8_t>(values[i] - key[i]);
    }
  }
  to_differences(values, column.lag);
  column.planes = planes_for(values);
  put_planes(values, column.planes, out);
}

void put(ByteView raw, Column& column, Key& key, Bytes& out) {
  if (column.kind != ColumnKind::kPlain) {
    const auto values = gather<std::uint32_t>(raw, column);
    const std::size_t before = out.size();
    if (column.kind == ColumnKind::kRanks ? put_ranks(values, column, out)
                                          : put_steps(values, column, out))
      return;
    out.resize(before);
    column.kind = ColumnKind::kPlain;
    column.extra = 0;
  }
  switch (column.width) {
    case 1: return put_plain<std::uint8_t>(raw, column, key, out);
    case 2: return put_plain<std::uint16_t>(raw, column, key, out);
    case 4: return put_plain<std::uint32_t>(raw, column, key, out);
    default: return put_plain<std::uint64_t>(raw, column, key, out);
  }
}

// `key`: null if no later column needs the values.
template <class T>
bool take_plain(const Column& column, ByteView& from, Key* key, Bytes& raw) {
  auto values = take_planes<T>(from, column.elements(), column.planes);
  from_differences(values, column.lag);
  if constexpr (sizeof(T) == 1) {
    if (!column.minus) {
      if (key) *key = values;
    } else {
      if (!key || key->size() != values.size()) return false;
      for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<std::uint8_t>(values[i] + (*key)[i]);
    }
  }
  scatter(std::move(values), column, raw);
  return true;
}

bool take(const Column& column, ByteView& from, Key* key, Bytes& raw) {
  switch (column.kind) {
    case ColumnKind::kRanks:
      return are_bytes(column.extra) ? take_ranks<std::uint8_t>(column, from, raw)
                                     : take_ranks<std::uint16_t>(column, from, raw);
    case ColumnKind::kSteps: return take_steps(column, from, raw);
    case ColumnKind::kPlain: break;
  }
  switch (column.width) {
    case 1: return take_plain<std::uint8_t>(column, from, key, raw);
    case 2: return take_plain<std::uint16_t>(column, from, key, raw);
    case 4: return take_plain<std::uint32_t>(column, from, key, raw);
    default: return take_plain<std::uint64_t>(column, from, key, raw);
  }
}

// ---- the head

void put_head(const Columns& columns, Bytes& body) {
  body.push_back(kVersion);
  body.push_back(static_cast<std::uint8_t>(columns.size()));
  for (const Column& column : columns) {
    put_le(column.begin, body);
    put_le(column.rows, body);
    put_le(column.row_stride, body);
    put_le(column.count, body);
    put_le(column.stride, body);
    body.push_back(static_cast<std::uint8_t>(column.kind));
    body.push_back(column.width);
    body.push_back(column.planes);
    body.push_back(column.lag);
    body.push_back(static_cast<std::uint8_t>((column.big_endian ? kBigEndian : 0) |
                                             (column.minus ? kMinus : 0)));
    body.push_back(0);
    put_le(column.extra, body);
    put_le(column.listed, body);
  }
}

// Bytes of the column in the frame.
std::uint64_t stored_bytes(const Column& column) {
  const std::uint64_t table = column.kind == ColumnKind::kRanks ? column.extra : column.listed;
  return 4 * table + column.elements() * column.planes;
}

bool is_sound(const Column& column) {
  if (column.rows == 0 || column.count == 0 || column.planes == 0) return false;
  switch (column.kind) {
    case ColumnKind::kPlain:
      return std::has_single_bit(column.width) && column.width <= 8 &&
             column.planes <= column.width && column.extra == 0 && column.listed == 0 &&
             (column.width == 1 || !column.minus);
    case ColumnKind::kRanks:
      return column.width == 4 && column.planes <= (are_bytes(column.extra) ? 1 : 2) &&
             column.extra >= 1 && column.extra <= kRanksMax && column.listed == 0 && !column.minus;
    case ColumnKind::kSteps:
      return column.width == 4 && column.planes <= kStepPlanesMax && column.extra >= 1 &&
             column.listed <= column.elements() && !column.minus;
  }
  return false;
}

std::optional<Column> column_at(ByteView body, std::size_t at) {
  const std::uint8_t flags = body[at + 22];
  Column column;
  column.begin = get_le<std::uint32_t>(body, at);
  column.rows = get_le<std::uint32_t>(body, at + 4);
  column.row_stride = get_le<std::uint32_t>(body, at + 8);
  column.count = get_le<std::uint32_t>(body, at + 12);
  column.stride = get_le<std::uint16_t>(body, at + 16);
  column.kind = static_cast<ColumnKind>(body[at + 18]);
  column.width = body[at + 19];
  column.planes = body[at + 20];
  column.lag = body[at + 21];
  column.big_endian = (flags & kBigEndian) != 0;
  column.minus = (flags & kMinus) != 0;
  column.extra = get_le<std::uint32_t>(body, at + 24);
  column.listed = get_le<std::uint32_t>(body, at + 28);
  if (flags > (kBigEndian | kMinus) || body[at + 23] != 0 || !is_sound(column)) return std::nullopt;
  return column;
}

struct Head {
  Columns columns;
  std::uint64_t raw_bytes = 0;     // of all elements
  std::uint64_t stored_bytes = 0;  // of the frame, uncompressed
};

std::optional<Head> read_head(ByteView body) {
  if (body.size() < kHeadBytes || body[0] != kVersion || body[1] == 0) return std::nullopt;
  const std::size_t count = body[1];
  if (body.size() < kHeadBytes + count * kColumnBytes) return std::nullopt;
  Head head;
  head.columns.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto column = column_at(body, kHeadBytes + i * kColumnBytes);
    if (!column || column->elements() > std::numeric_limits<std::uint32_t>::max())
      return std::nullopt;
    head.raw_bytes += column->bytes();
    head.stored_bytes += stored_bytes(*column);
    head.columns.push_back(*column);
  }
  return head;
}

bool is_within(const Column& column, std::size_t raw_bytes) {
  const std::uint64_t last = column.begin + std::uint64_t{column.rows - 1} * column.row_stride +
                             std::uint64_t{column.count - 1} * column.stride;
  return last < raw_bytes && column.width <= raw_bytes - last;
}

std::optional<Bytes> encode(ByteView raw, Columns columns, int level,
                            const std::atomic<bool>* give_up) {
  Bytes stored;
  stored.reserve(raw.size());
  Key key;
  for (Column& column : columns) {
    if (give_up && *give_up) return std::nullopt;
    put(raw, column, key, stored);
  }
  if (stored.size() > raw.size()) return std::nullopt;
  const auto frame = compress(stored, {Codec::kZstd, level}, give_up);
  if (!frame) return std::nullopt;
  Bytes body;
  body.reserve(kHeadBytes + columns.size() * kColumnBytes + frame->size());
  put_head(columns, body);
  body.insert(body.end(), frame->begin(), frame->end());
  if (body.size() >= raw.size()) return std::nullopt;
  return body;
}

// The middle of a column, so many parts of it.
Column middle_of(const Column& column, std::uint32_t parts) {
  Column part = column;
  const bool by_rows = column.rows > 1;
  const std::uint32_t all = by_rows ? column.rows : column.count;
  const std::uint32_t some = std::max(all / parts, 1U);
  const std::uint32_t first = (all - some) / 2;
  (by_rows ? part.rows : part.count) = some;
  part.begin += first * (by_rows ? column.row_stride : column.stride);
  return part;
}

// Drawings and labels repeat themselves, and zstd alone finds that better than any difference.
bool shrinks_more_as_it_is(ByteView raw, const Columns& columns, int level) {
  const auto parts = static_cast<std::uint32_t>(raw.size() / kTrialBytes + 1);
  std::size_t bytes = 0;
  Columns some;
  for (const Column& column : columns) some.push_back(middle_of(column, parts));
  for (const Column& column : some) bytes += column.bytes();
  const std::size_t size = std::min(bytes, raw.size());
  const ByteView middle = raw.subspan((raw.size() - size) / 2, size);
  Bytes stored;
  stored.reserve(bytes);
  Key key;
  for (Column& column : some) put(raw, column, key, stored);
  const Compression how{Codec::kZstd, level};
  const auto plain = compress(middle, how);
  if (!plain) return false;
  const auto arranged = compress(stored, how);
  return !arranged || arranged->size() > plain->size();
}

}  // namespace

Columns opaque(std::size_t raw_bytes) {
  Column all;
  all.count = static_cast<std::uint32_t>(raw_bytes);
  return {all};
}

std::optional<Bytes> encode_columns(ByteView raw, const Columns& columns, int level,
                                    const std::atomic<bool>* give_up) {
  if (raw.empty() || raw.size() > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  const bool exact = std::none_of(columns.begin(), columns.end(), [](const Column& column) {
    return column.kind == ColumnKind::kSteps;
  });
  if (columns.size() > 1 && exact && shrinks_more_as_it_is(raw, columns, level))
    return encode(raw, opaque(raw.size()), level, give_up);
  return encode(raw, columns, level, give_up);
}

Result<Bytes> decode_columns(ByteView body, std::size_t raw_bytes, Steps steps) {
  const auto head = read_head(body);
  if (!head || head->raw_bytes != raw_bytes || raw_bytes == 0 || head->stored_bytes > raw_bytes)
    return malformed("the head of a body of planes does not agree with its size");
  for (const Column& column : head->columns) {
    if (!is_within(column, raw_bytes))  // mutant: column_within
      return malformed("a column is not within the sample");
    if (column.kind == ColumnKind::kSteps && steps == Steps::kRefused)  // mutant: lossy_planes
      return malformed("planes are exact");
  }
  const ByteView frame = body.subspan(kHeadBytes + head->columns.size() * kColumnBytes);
  auto stored = decompress(frame, Codec::kZstd, head->stored_bytes);
  if (!stored) return stored.error();
  Bytes raw(raw_bytes);
  ByteView rest = stored.value();
  Key key;
  const auto& columns = head->columns;
  for (auto column = columns.begin(); column != columns.end(); ++column) {
    const bool needs_key =
        std::any_of(column, columns.end(), [](const Column& later) { return later.minus; });
    if (!take(*column, rest, needs_key ? &key : nullptr, raw))
      return malformed("a column is damaged");
  }
  return raw;
}

std::optional<BodyFacts> facts_of(ByteView body) {
  const auto head = read_head(body);
  if (!head) return std::nullopt;
  BodyFacts facts{head->raw_bytes, 0};
  for (const Column& column : head->columns)
    if (column.kind == ColumnKind::kSteps) facts.step_um = std::max(facts.step_um, column.extra);
  return facts;
}

std::vector<std::uint32_t> some_of(ByteView raw, const Column& column, std::size_t most) {
  const auto parts =
      static_cast<std::uint32_t>((column.elements() + most - 1) / std::max<std::size_t>(most, 1));
  const Column some = parts > 1 ? middle_of(column, parts) : column;
  const auto widened = [&]<class T>(const std::vector<T>& values) {
    return std::vector<std::uint32_t>(values.begin(), values.end());
  };
  switch (column.width) {
    case 1: return widened(gather<std::uint8_t>(raw, some));
    case 2: return widened(gather<std::uint16_t>(raw, some));
    case 4: return gather<std::uint32_t>(raw, some);
    default: {
      std::vector<std::uint32_t> low;
      for (const std::uint64_t value : gather<std::uint64_t>(raw, some))
        low.push_back(static_cast<std::uint32_t>(value));
      return low;
    }
  }
}

std::optional<std::int32_t> steps_of(float value, std::uint32_t step_um) {
  const double step = metres(step_um);
  const double count = value / step;
  if (!(std::abs(count) < kStepsMax)) return std::nullopt;  // not finite, or too far away
  const auto steps = static_cast<std::int32_t>(count + (count < 0 ? -0.5 : 0.5));
  const double error = std::abs(static_cast<double>(value_of(steps, step)) - value);
  return error <= step / 2 ? std::optional(steps) : std::nullopt;
}

}  // namespace connect_bridge::media
