// Writes the fields of a control message as JSON.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/hex.hpp"
#include "core/base/json.hpp"
#include "core/base/result.hpp"
#include "core/wire/control_fields.hpp"
#include "core/wire/text.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {

// Adds fields to one JSON object, in the order in which they are named. Has the functions of
// ControlReader. A message whose lists are too long is written in parts. Each part has its piece of
// every list, up to the list's limit, and all other members.
class ControlWriter {
 public:
  static constexpr bool kWrites = true;

  explicit ControlWriter(OrderedJson& object) : object_(object) {}
  // Writes this part of the message; the first is 0.
  ControlWriter(OrderedJson& object, std::size_t part) : object_(object), part_(part) {}

  // True: no list continues after this part.
  [[nodiscard]] bool is_last_part() const { return is_last_part_; }

  void check(bool, std::string_view, const char*, CloseCode = CloseCode::kMalformed) {}

  template <class T>
  bool member(std::string_view name, const T& value, Presence presence = Presence::kRequired) {
    if (presence == Presence::kOptional && value == T{}) return false;
    member_of(name) = json_of(value);
    return true;
  }

  bool text(std::string_view name, const std::string& value, std::size_t, Presence presence) {
    return member(name, value, presence);
  }

  void cleaned(std::string_view name, const std::string& value, std::size_t bytes_max) {
    member_of(name) = to_text(value, bytes_max);
  }

  template <class T>
  bool list(std::string_view name, const std::vector<T>& values, std::size_t items_max,
            Presence presence = Presence::kRequired) {
    if (presence == Presence::kOptional && values.empty()) return false;
    const std::size_t first = part_ ? std::min(values.size(), *part_ * items_max) : 0;
    const std::size_t end = part_ ? std::min(values.size(), first + items_max) : values.size();
    is_last_part_ = is_last_part_ && end == values.size();
    OrderedJson::array_t entries;
    entries.reserve(end - first);
    for (std::size_t i = first; i < end; ++i) entries.push_back(json_of(values[i]));
    member_of(name) = std::move(entries);
    return true;
  }

  template <class Enum, std::size_t N>
  void word(std::string_view name, Enum value, const std::array<Word<Enum>, N>& words) {
    member_of(name) = word_of(words, value);
  }

  template <class Enum, std::size_t N>
  void optional_word(std::string_view name, std::optional<Enum> value,
                     const std::array<Word<Enum>, N>& words) {
    if (value) word(name, *value, words);
  }

  template <class Flags, std::size_t N>
  void flags(std::string_view name, const Flags& value,
             const std::array<Word<bool Flags::*>, N>& words, std::size_t) {
    OrderedJson::array_t entries;
    for (const auto& [flag, word] : words)
      if (value.*flag) entries.emplace_back(word);
    if (!entries.empty()) member_of(name) = std::move(entries);
  }

  void duration(std::string_view name, Duration value) {
    if (value >= Duration::zero() && value <= kDurationMax) member_of(name) = value.count();
  }

 private:
  OrderedJson& member_of(std::string_view name) { return object_[std::string{name}]; }

  static OrderedJson json_of(const std::string& text) { return text; }
  static OrderedJson json_of(const std::integral auto& number) { return number; }
  template <class Tag, class Value>
  static OrderedJson json_of(Id<Tag, Value> id) {
    return id.value;
  }
  template <class T>
  static OrderedJson json_of(const std::optional<T>& value) {
    return json_of(*value);
  }
  static OrderedJson json_of(const Gid& gid) { return to_hex(gid.bytes); }
  static OrderedJson json_of(const Token128& token) { return to_hex(token.bytes); }
  static OrderedJson json_of(InterfaceKind kind) { return word_of(kKindWords, kind); }
  template <class T>
  static OrderedJson json_of(const T& object) {
    OrderedJson json = OrderedJson::object();
    ControlWriter writer{json};
    fields(writer, object);
    return json;
  }

  OrderedJson& object_;
  std::optional<std::size_t> part_;  // none: the whole message
  bool is_last_part_ = true;
};

}  // namespace connect_bridge
