#include "sim/digest.hpp"

#include <concepts>
#include <exception>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

namespace connect_bridge::sim {
namespace {

constexpr std::uint64_t kPacket = 1'000;  // in addition to the indexes of Action

// Stands for a value of any type where an aggregate is initialized.
struct Any {
  template <class T>
  operator T() const {
    std::terminate();  // only named, never called
  }
};

template <class T, std::size_t... I>
constexpr bool takes(std::index_sequence<I...>) {
  return requires {
    T{(static_cast<void>(I), Any{})...};
  };
}

// How many fields an aggregate has.
template <class T, std::size_t N = 0>
constexpr std::size_t fields() {
  if constexpr (takes<T>(std::make_index_sequence<N + 1>{})) return fields<T, N + 1>();
  return N;
}

// Calls `use` with each field of an aggregate. A new field is thus never forgotten.
template <class T, class F>
void for_each_field(const T& value, const F& use) {
  constexpr std::size_t kFields = fields<T>();
  static_assert(kFields <= 9, "add a case");
  const auto all = [&](const auto&... field) { (use(field), ...); };
  if constexpr (kFields == 1) {
    const auto& [a] = value;
    all(a);
  } else if constexpr (kFields == 2) {
    const auto& [a, b] = value;
    all(a, b);
  } else if constexpr (kFields == 3) {
    const auto& [a, b, c] = value;
    all(a, b, c);
  } else if constexpr (kFields == 4) {
    const auto& [a, b, c, d] = value;
    all(a, b, c, d);
  } else if constexpr (kFields == 5) {
    const auto& [a, b, c, d, e] = value;
    all(a, b, c, d, e);
  } else if constexpr (kFields == 6) {
    const auto& [a, b, c, d, e, f] = value;
    all(a, b, c, d, e, f);
  } else if constexpr (kFields == 7) {
    const auto& [a, b, c, d, e, f, g] = value;
    all(a, b, c, d, e, f, g);
  } else if constexpr (kFields == 8) {
    const auto& [a, b, c, d, e, f, g, h] = value;
    all(a, b, c, d, e, f, g, h);
  } else if constexpr (kFields == 9) {
    const auto& [a, b, c, d, e, f, g, h, i] = value;
    all(a, b, c, d, e, f, g, h, i);
  }
}

template <class T>
constexpr bool is_duration = false;
template <class R, class P>
constexpr bool is_duration<std::chrono::duration<R, P>> = true;

template <class T>
constexpr bool is_optional = false;
template <class T>
constexpr bool is_optional<std::optional<T>> = true;

}  // namespace

void Digest::add(std::uint64_t number) {
  for (int shift = 0; shift < 64; shift += 8) {
    value_ = (value_ ^ (number >> shift & 0xff)) * 1099511628211ULL;
  }
}

void Digest::feed_bytes(ByteView bytes) {
  add(bytes.size());
  for (const std::uint8_t byte : bytes) value_ = (value_ ^ byte) * 1099511628211ULL;
}

template <class T>
void Digest::feed(const T& value) {
  if constexpr (std::integral<T> || std::is_enum_v<T>) {
    add(static_cast<std::uint64_t>(value));
  } else if constexpr (is_duration<T>) {
    add(static_cast<std::uint64_t>(std::chrono::nanoseconds(value).count()));
  } else if constexpr (std::same_as<T, std::string>) {
    feed_bytes(Bytes{value.begin(), value.end()});
  } else if constexpr (std::same_as<T, Payload>) {
    feed_bytes(value.view());
  } else if constexpr (std::same_as<T, Log>) {
    feed(value.level);
  } else if constexpr (is_optional<T>) {
    add(value.has_value() ? 1 : 0);
    if (value) feed(*value);
  } else if constexpr (requires { value.begin(); }) {
    add(value.size());
    for (const auto& element : value) feed(element);
  } else {
    static_assert(std::is_aggregate_v<T>, "say how this type is read");
    for_each_field(value, [this](const auto& field) { this->feed(field); });
  }
}

void Digest::begin(std::uint64_t kind, int side, TimePoint at) {
  add(kind);
  feed(side);
  feed(at.time_since_epoch());
}

void Digest::add_action(int side, TimePoint at, const Action& action) {
  begin(action.index(), side, at);
  std::visit([this](const auto& value) { feed(value); }, action);
}

void Digest::add_packet(int side, TimePoint at, ConnectionId connection, bool text,
                        ByteView bytes) {
  begin(kPacket, side, at);
  feed(connection);
  feed(text);
  feed_bytes(bytes);
}

}  // namespace connect_bridge::sim
