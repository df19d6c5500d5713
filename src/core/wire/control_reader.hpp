// Reads the fields of a control message from its values, and checks each field. Everything here is
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
#include "core/base/result.hpp"
#include "core/wire/control_fields.hpp"
#include "core/wire/control_values.hpp"
#include "core/wire/text.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {

// Reads the fields of one JSON object. The readers of a message share `error`, which keeps the
// first error. After an error nothing is read, so callers check once, at the end.
class ControlReader {
 public:
  static constexpr bool kWrites = false;

  ControlReader(const ControlValue& object, std::optional<Error>& error)
      : object_(object), error_(error) {}

  void check(bool holds, std::string_view name, const char* wrong,
             CloseCode code = CloseCode::kMalformed) {
    if (holds || error_) return;
    error_ = Error{code, "a control message's \"" + std::string{name} + "\" " + wrong};
  }

  // The functions below return whether the member is there.
  template <class T>
  bool member(std::string_view name, T& value, Presence presence = Presence::kRequired) {
    const ControlValue* found = find(name, presence);
    if (found != nullptr) read(*found, name, value);
    return found != nullptr;
  }

  bool text(std::string_view name, std::string& value, std::size_t bytes_max, Presence presence) {
    const ControlValue* found = find(name, presence);
    if (found != nullptr) value = text_of(*found, name, bytes_max);
    return found != nullptr;
  }

  void cleaned(std::string_view name, std::string& value, std::size_t bytes_max) {
    text(name, value, bytes_max, Presence::kDefault);
  }

  template <class T>
  bool list(std::string_view name, std::vector<T>& values, std::size_t items_max,
            Presence presence = Presence::kRequired) {
    const ControlValue* found = find(name, presence);
    if (found == nullptr) return false;
    check(found->type == Type::kList, name, "is not a list");
    for (auto* entry = found->first(); !error_ && entry != found->last(); entry = entry->next()) {
      check(values.size() < items_max, name, "has too many entries", CloseCode::kTooLarge);
      read(*entry, name, values.emplace_back());
    }
    return true;
  }

  template <class Enum, std::size_t N>
  void word(std::string_view name, Enum& value, const std::array<Word<Enum>, N>& words) {
    const ControlValue* found = find(name, Presence::kDefault);
    if (found == nullptr) return;
    const auto known = found->type == Type::kText ? value_of(words, found->text) : std::nullopt;
    check(known.has_value(), name, "is not one of its words");
    value = known.value_or(value);
  }

  template <class Enum, std::size_t N>
  void optional_word(std::string_view name, std::optional<Enum>& value,
                     const std::array<Word<Enum>, N>& words) {
    const ControlValue* found = find(name, Presence::kOptional);
    if (found == nullptr) return;
    if (found->type == Type::kText) value = value_of(words, found->text);
    check(value.has_value(), name, "is not one of its words");
  }

  template <class Flags, std::size_t N>
  void flags(std::string_view name, Flags& value, const std::array<Word<bool Flags::*>, N>& words,
             std::size_t items_max) {
    std::vector<std::string> entries;
    list(name, entries, items_max, Presence::kOptional);
    for (const auto& entry : entries)
      if (const auto flag = value_of(words, entry)) value.** flag = true;
  }

  void duration(std::string_view name, Duration& value) {
    const ControlValue* found = find(name, Presence::kOptional);
    if (found == nullptr) return;
    const bool fits =
        found->type == Type::kUnsigned && std::cmp_less_equal(found->number, kDurationMax.count());
    check(fits, name, "is not a duration in nanoseconds");
    if (fits) value = Duration{static_cast<Duration::rep>(found->number)};
  }

 private:
  using Type = ControlValue::Type;

  // The member, the last one of the name, or nullptr. An absent member is an error if it is
  // required.
  const ControlValue* find(std::string_view name, Presence presence) {
    if (error_) return nullptr;
    const ControlValue* found = nullptr;
    for (auto* member = object_.first(); member != object_.last(); member = member->next()) {
      if (member->name == name) found = member;
    }
    check(found != nullptr || presence != Presence::kRequired, name, "is missing");
    return found;
  }

  // The text; empty if the value is no valid text.
  std::string_view text_of(const ControlValue& value, std::string_view name,
                           std::size_t bytes_max) {
    check(value.type == Type::kText, name, "is not a string");
    check(value.text.size() <= bytes_max, name, "is too long", CloseCode::kTooLarge);
    check(error_ || is_text(value.text), name, "contains a control character");
    return error_ ? std::string_view{} : value.text;
  }

  template <class T>
  void read_number(const ControlValue& value, std::string_view name, T& number, T least) {
    const bool fits = value.type == Type::kUnsigned && value.number >= least &&
                      value.number <= std::numeric_limits<T>::max();
    check(fits, name, "is not an integer in its range");
    if (fits) number = static_cast<T>(value.number);
  }

  template <class Bytes>
  void read_hex(const ControlValue& value, std::string_view name, Bytes& bytes, const char* wrong) {
    check(from_hex(text_of(value, name, 2 * bytes.size()), bytes), name, wrong);
  }

  void read(const ControlValue& value, std::string_view name, bool& yes) {
    check(value.type == Type::kBoolean, name, "is neither true nor false");
    yes = value.number == 1;
  }
  void read(const ControlValue& value, std::string_view name, std::string& text) {
    text = text_of(value, name, kNameBytesMax);
  }
  template <std::unsigned_integral T>
  void read(const ControlValue& value, std::string_view name, T& number) {
    read_number(value, name, number, T{0});
  }
  template <class Tag, class Value>
  void read(const ControlValue& value, std::string_view name, Id<Tag, Value>& id) {
    read_number(value, name, id.value, Value{1});
  }
  template <class T>
  void read(const ControlValue& value, std::string_view name, std::optional<T>& number) {
    read(value, name, number.emplace());
  }
  void read(const ControlValue& value, std::string_view name, Gid& gid) {
    read_hex(value, name, gid.bytes, "is not 48 hexadecimal digits");
  }
  void read(const ControlValue& value, std::string_view name, Token128& token) {
    read_hex(value, name, token.bytes, "is not 32 hexadecimal digits");
  }
  void read(const ControlValue& value, std::string_view name, InterfaceKind& kind) {
    kind =
        value_of(kKindWords, text_of(value, name, kNameBytesMax)).value_or(InterfaceKind::kOther);
  }
  template <class T>
  void read(const ControlValue& value, std::string_view name, T& object) {
    check(value.type == Type::kObject, name, "is not an object");
    if (error_) return;
    ControlReader reader{value, error_};
    fields(reader, object);
  }

  const ControlValue& object_;
  std::optional<Error>& error_;
};

}  // namespace connect_bridge
