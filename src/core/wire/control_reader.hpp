// The JSON of a control message -> its fields, each checked as it is read. Everything here is
// hostile until it is checked.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/hex.hpp"
#include "core/base/json.hpp"
#include "core/base/result.hpp"
#include "core/wire/control_fields.hpp"
#include "core/wire/text.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {

// Reads the fields of one JSON object. The first error is kept in `error`, which the readers of a
// message share; after it nothing is read, so that callers check once, at the end.
class ControlReader {
 public:
  static constexpr bool kWrites = false;

  ControlReader(const Json& object, std::optional<Error>& error) : object_(object), error_(error) {}

  void check(bool holds, std::string_view key, const char* wrong,
             CloseCode code = CloseCode::kMalformed) {
    if (holds || error_) return;
    error_ = Error{code, "a control message's \"" + std::string{key} + "\" " + wrong};
  }

  // These return whether the member is there.
  template <class T>
  bool member(const char* key, T& value, Presence presence = Presence::kRequired) {
    const Json* json = find(key, presence);
    if (json != nullptr) read(*json, key, value);
    return json != nullptr;
  }

  bool text(const char* key, std::string& value, std::size_t bytes_max, Presence presence) {
    const Json* json = find(key, presence);
    if (json != nullptr) read_text(*json, key, value, bytes_max);
    return json != nullptr;
  }

  void cleaned(const char* key, std::string& value, std::size_t bytes_max) {
    text(key, value, bytes_max, Presence::kDefault);
  }

  template <class T>
  bool list(const char* key, std::vector<T>& values, std::size_t items_max,
            Presence presence = Presence::kRequired) {
    const Json* json = find(key, presence);
    if (json == nullptr) return false;
    check(json->is_array(), key, "is not a list");
    check(json->size() <= items_max, key, "has too many entries", CloseCode::kTooLarge);
    for (auto entry = json->begin(); !error_ && entry != json->end(); ++entry)
      read(*entry, key, values.emplace_back());
    return true;
  }

  template <class Enum, std::size_t N>
  void word(const char* key, Enum& value, const std::array<Word<Enum>, N>& words) {
    const Json* json = find(key, Presence::kDefault);
    if (json == nullptr) return;
    const auto* text = json->get_ptr<const Json::string_t*>();
    const auto found = text == nullptr ? std::nullopt : value_of(words, *text);
    check(found.has_value(), key, "is not one of its words");
    value = found.value_or(value);
  }

  void duration(const char* key, Duration& value) {
    const Json* json = find(key, Presence::kOptional);
    if (json == nullptr) return;
    const auto* number = json->get_ptr<const Json::number_unsigned_t*>();
    const bool fits = number != nullptr && std::cmp_less_equal(*number, kDurationMax.count());
    check(fits, key, "is not a duration in nanoseconds");
    if (fits) value = Duration{static_cast<Duration::rep>(*number)};
  }

 private:
  // The member, or nullptr; an absent one is an error if it is required.
  const Json* find(const char* key, Presence presence) {
    if (error_) return nullptr;
    const auto found = object_.find(key);
    if (found != object_.end()) return &*found;
    check(presence != Presence::kRequired, key, "is missing");
    return nullptr;
  }

  void read_text(const Json& json, const char* key, std::string& value, std::size_t bytes_max) {
    const auto* text = json.get_ptr<const Json::string_t*>();
    check(text != nullptr, key, "is not a string");
    check(!text || text->size() <= bytes_max, key, "is too long", CloseCode::kTooLarge);
    check(!text || is_text(*text), key, "contains a control character");
    if (!error_) value = *text;
  }

  template <class T>
  void read_number(const Json& json, const char* key, T& value, T least) {
    const auto* number = json.get_ptr<const Json::number_unsigned_t*>();
    const bool fits =
        number != nullptr && *number >= least && *number <= std::numeric_limits<T>::max();
    check(fits, key, "is not an integer in its range");
    if (fits) value = static_cast<T>(*number);
  }

  template <class Bytes>
  void read_hex(const Json& json, const char* key, Bytes& bytes, const char* wrong) {
    std::string digits;
    read_text(json, key, digits, 2 * bytes.size());
    check(from_hex(digits, bytes), key, wrong);
  }

  void read(const Json& json, const char* key, bool& value) {
    check(json.is_boolean(), key, "is neither true nor false");
    value = json.is_boolean() && json.get<bool>();
  }
  void read(const Json& json, const char* key, std::string& value) {
    read_text(json, key, value, kNameBytesMax);
  }
  template <std::unsigned_integral T>
  void read(const Json& json, const char* key, T& value) {
    read_number(json, key, value, T{0});
  }
  template <class Tag, class Value>
  void read(const Json& json, const char* key, Id<Tag, Value>& id) {
    read_number(json, key, id.value, Value{1});
  }
  template <class T>
  void read(const Json& json, const char* key, std::optional<T>& value) {
    read(json, key, value.emplace());
  }
  void read(const Json& json, const char* key, Gid& gid) {
    read_hex(json, key, gid.bytes, "is not 48 hexadecimal digits");
  }
  void read(const Json& json, const char* key, Token128& token) {
    read_hex(json, key, token.bytes, "has an entry that is not 32 hexadecimal digits");
  }
  void read(const Json& json, const char* key, InterfaceKind& kind) {
    std::string word;
    read(json, key, word);
    kind = value_of(kKindWords, word).value_or(InterfaceKind::kOther);
  }
  template <class T>
  void read(const Json& json, const char* key, T& object) {
    check(json.is_object(), key, "is not an object");
    if (error_) return;
    ControlReader reader{json, error_};
    fields(reader, object);
  }

  const Json& object_;
  std::optional<Error>& error_;
};

}  // namespace connect_bridge
