// The fields of a control message -> its JSON.
#pragma once

#include <array>
#include <concepts>
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
// ControlReader.
class ControlWriter {
 public:
  static constexpr bool kWrites = true;

  explicit ControlWriter(OrderedJson& object) : object_(object) {}

  void check(bool, const char*, const char*, CloseCode = CloseCode::kMalformed) {}

  template <class T>
  bool member(const char* key, const T& value, Presence presence = Presence::kRequired) {
    if (presence == Presence::kOptional && value == T{}) return false;
    object_[key] = json_of(value);
    return true;
  }

  bool text(const char* key, const std::string& value, std::size_t, Presence presence) {
    return member(key, value, presence);
  }

  void cleaned(const char* key, const std::string& value, std::size_t bytes_max) {
    object_[key] = to_text(value, bytes_max);
  }

  template <class T>
  bool list(const char* key, const std::vector<T>& values, std::size_t,
            Presence presence = Presence::kRequired) {
    if (presence == Presence::kOptional && values.empty()) return false;
    OrderedJson::array_t entries;
    entries.reserve(values.size());
    for (const T& value : values) entries.push_back(json_of(value));
    object_[key] = std::move(entries);
    return true;
  }

  template <class Enum, std::size_t N>
  void word(const char* key, Enum value, const std::array<Word<Enum>, N>& words) {
    object_[key] = word_of(words, value);
  }

  void duration(const char* key, Duration value) {
    if (value >= Duration::zero() && value <= kDurationMax) object_[key] = value.count();
  }

 private:
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
};

}  // namespace connect_bridge
