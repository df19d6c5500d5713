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
#include "core/wire/control_names.hpp"
#include "core/wire/text.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {

// Adds fields to one JSON object, in the order in which they are named. Has the functions of
// ControlReader.
class ControlWriter {
 public:
  static constexpr bool kWrites = true;

  explicit ControlWriter(OrderedJson& object) : object_(object) {}

  void check(bool, MemberName, const char*, CloseCode = CloseCode::kMalformed) {}

  template <class T>
  bool member(MemberName name, const T& value, Presence presence = Presence::kRequired) {
    if (presence == Presence::kOptional && value == T{}) return false;
    member_of(name) = json_of(value);
    return true;
  }

  bool text(MemberName name, const std::string& value, std::size_t, Presence presence) {
    return member(name, value, presence);
  }

  void cleaned(MemberName name, const std::string& value, std::size_t bytes_max) {
    member_of(name) = to_text(value, bytes_max);
  }

  template <class T>
  bool list(MemberName name, const std::vector<T>& values, std::size_t,
            Presence presence = Presence::kRequired) {
    if (presence == Presence::kOptional && values.empty()) return false;
    OrderedJson::array_t entries;
    entries.reserve(values.size());
    for (const T& value : values) entries.push_back(json_of(value));
    member_of(name) = std::move(entries);
    return true;
  }

  template <class Enum, std::size_t N>
  void word(MemberName name, Enum value, const std::array<Word<Enum>, N>& words) {
    member_of(name) = word_of(words, value);
  }

  void duration(MemberName name, Duration value) {
    if (value >= Duration::zero() && value <= kDurationMax) member_of(name) = value.count();
  }

 private:
  OrderedJson& member_of(MemberName name) { return object_[std::string{name.text()}]; }

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
