// The members of a control message's JSON, each checked as it is read. Used by control_decode.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/json.hpp"
#include "core/base/result.hpp"
#include "core/wire/control.hpp"
#include "core/wire/login.hpp"
#include "core/wire/text.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {

// Reads the members of JSON objects. The first error is kept; after it every read returns a
// default, so that callers check once, at the end.
class ControlReader {
 public:
  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] const Error& error() const { return error_; }

  void fail(std::string_view key, const char* expected, CloseCode code = CloseCode::kMalformed) {
    if (failed_) return;
    failed_ = true;
    error_ = Error{code, "a control message's \"" + std::string{key} + "\" " + expected};
  }

  // The member, or nullptr; an absent member is an error unless it is optional.
  const Json* find(const Json& object, const char* key, bool optional = false) {
    if (failed_) return nullptr;
    const auto member = object.find(key);
    if (member != object.end()) return &*member;
    if (!optional) fail(key, "is missing");
    return nullptr;
  }

  const Json* array(const Json& object, const char* key, std::size_t items_max) {
    const Json* list = find(object, key);
    if (list == nullptr) return nullptr;
    if (!list->is_array()) {
      fail(key, "is not a list");
      return nullptr;
    }
    if (list->size() > items_max) {
      fail(key, "has too many entries", CloseCode::kTooLarge);
      return nullptr;
    }
    return list;
  }

  const Json& object(const Json& value, const char* key) {
    static const Json kEmpty = Json::object();
    if (value.is_object()) return value;
    fail(key, "is not an object");
    return kEmpty;
  }

  std::string string_of(const Json& value, const char* key, std::size_t bytes_max) {
    const auto* text = value.get_ptr<const Json::string_t*>();
    if (text == nullptr) {
      fail(key, "is not a string");
    } else if (text->size() > bytes_max) {
      fail(key, "is too long", CloseCode::kTooLarge);
    } else if (!is_text(*text)) {
      fail(key, "contains a control character");
    } else {
      return *text;
    }
    return {};
  }

  std::string string(const Json& json, const char* key, std::size_t bytes_max) {
    const Json* value = find(json, key);
    return value == nullptr ? std::string{} : string_of(*value, key, bytes_max);
  }

  // A word of [a-z0-9_], 1 to 32 bytes.
  std::string identifier(const Json& json, const char* key) {
    std::string word = string(json, key, kCodeBytesMax);
    if (!is_method(word)) fail(key, "is not a word of [a-z0-9_]");
    return word;
  }

  std::string optional_string(const Json& json, const char* key, std::size_t bytes_max) {
    const Json* value = find(json, key, true);
    return value == nullptr ? std::string{} : string_of(*value, key, bytes_max);
  }

  template <class T = std::uint32_t>
  T number_of(const Json& value, const char* key, T least) {
    const auto* number = value.get_ptr<const Json::number_unsigned_t*>();
    if (number != nullptr && *number >= least && *number <= std::numeric_limits<T>::max())
      return static_cast<T>(*number);
    fail(key, "is not an integer in its range");
    return least;
  }

  std::uint32_t id(const Json& json, const char* key) {
    const Json* value = find(json, key);
    return value == nullptr ? 0 : number_of(*value, key, 1U);
  }

  std::uint32_t optional_number(const Json& json, const char* key) {
    const Json* value = find(json, key, true);
    return value == nullptr ? 0 : number_of(*value, key, 0U);
  }

  Duration duration(const Json& json, const char* key) {
    const Json* value = find(json, key, true);
    if (value == nullptr) return kForever;
    const auto* number = value->get_ptr<const Json::number_unsigned_t*>();
    if (number != nullptr && *number <= static_cast<std::uint64_t>(kDurationMax.count())) {
      return Duration{static_cast<Duration::rep>(*number)};
    }
    fail(key, "is not a duration in nanoseconds");
    return kForever;
  }

  bool flag(const Json& json, const char* key, bool optional) {
    const Json* value = find(json, key, optional);
    if (value == nullptr) return false;
    if (!value->is_boolean()) fail(key, "is neither true nor false");
    return value->is_boolean() && value->get<bool>();
  }

  // One of `words`; `otherwise` if it is absent.
  template <class Enum, std::size_t N>
  Enum word(const Json& json, const char* key, const std::array<Word<Enum>, N>& words,
            Enum otherwise) {
    const Json* value = find(json, key, true);
    if (value == nullptr) return otherwise;
    const auto* text = value->get_ptr<const Json::string_t*>();
    const auto found = text == nullptr ? std::nullopt : value_of(words, *text);
    if (!found) fail(key, "is not one of its words");
    return found.value_or(otherwise);
  }

 private:
  bool failed_ = false;
  Error error_;
};

}  // namespace connect_bridge
