// Adds rows to the table of keys. A row names the field that stores its value; its type and its
// default follow from the field.
#pragma once

#include <concepts>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "config/key_table.hpp"
#include "config/syntax.hpp"
#include "core/policy/treatment.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {

using Strings = std::vector<std::string>;
using Rows = std::vector<KeySpec>;

inline constexpr double kGiB = 1024.0 * 1024.0 * 1024.0;  // in bytes, for the ranges

// The words that a parameter of the enum T accepts.
template <class T>
constexpr const auto& words_of() {
  if constexpr (std::is_same_v<T, Priority>) return kPriorityWords;
  if constexpr (std::is_same_v<T, Reliability>) return kReliabilityWords;
  if constexpr (std::is_same_v<T, Durability>) return kDurabilityWords;
  if constexpr (std::is_same_v<T, Keep>) return kKeepWords;
  if constexpr (std::is_same_v<T, Lossy>) return kLossyWords;
  if constexpr (std::is_same_v<T, NamedBy>) return syntax::kNamedByWords;
  if constexpr (std::is_same_v<T, LogLevel>) return syntax::kLogLevelWords;
  if constexpr (std::is_same_v<T, Role>) return syntax::kRoleWords;
}

// Writes the value of a parameter to a field.
template <class T>
void store(T& field, const ParameterValue& value) {
  if constexpr (std::is_same_v<T, Duration>) {
    field = syntax::from_seconds(std::get<double>(value));
  } else if constexpr (std::is_same_v<T, std::vector<Pattern>>) {
    field = syntax::parse_patterns(std::get<Strings>(value));
  } else if constexpr (std::is_same_v<T, Compression>) {
    field = syntax::parse_compression(std::get<std::string>(value)).value_or(Compression{});
  } else if constexpr (std::is_enum_v<T>) {
    field = value_of(words_of<T>(), std::get<std::string>(value)).value_or(T{});
  } else if constexpr (std::integral<T> && !std::is_same_v<T, bool>) {
    field = static_cast<T>(std::get<std::int64_t>(value));
  } else {
    field = std::get<T>(value);
  }
}

// A value of the parameter type of such a field; for a number or bool, the field's own value.
template <class T>
ParameterValue parameter_of(const T& field) {
  if constexpr (std::is_same_v<T, Duration>) {
    return std::chrono::duration<double>(field).count();
  } else if constexpr (std::integral<T> && !std::is_same_v<T, bool>) {
    return static_cast<std::int64_t>(field);
  } else if constexpr (std::is_arithmetic_v<T>) {
    return field;
  } else if constexpr (std::is_same_v<T, std::vector<Pattern>> || std::is_same_v<T, Strings>) {
    return Strings{};
  } else {
    return std::string{};
  }
}

// Sets the type and the words of the parameter of such a field.
template <class T>
void describe(KeySpec& spec, const ParameterValue& value) {
  spec.type = type_of(value);
  if constexpr (std::is_enum_v<T>)
    for (const auto& entry : words_of<T>()) spec.words.emplace_back(entry.word);
}

// `field` returns the address of the field in a Config or a Rule. The field's initial number, bool
// or empty list becomes the default, if the range allows it and the row has no other.
template <class Target, class T>
void store_in(KeySpec& spec, T* (*field)(Target&)) {
  static Target fresh;
  spec.store = Store<Target>([field](auto& to, auto& value) { store(*field(to), value); });
  ParameterValue initial = parameter_of(*field(fresh));
  describe<T>(spec, initial);
  if (!spec.fallback && spec.type != ParameterType::kString &&
      fit(spec.type, spec.range, initial) == Fit::kYes)
    spec.fallback = initial;
}
// A parameter without a default.
template <class Target, class T>
void store_in(KeySpec& spec, std::optional<T>* (*field)(Target&)) {
  spec.store =
      Store<Target>([field](auto& to, auto& value) { store(field(to)->emplace(), value); });
  describe<T>(spec, parameter_of(T{}));
}

// Adds rows under one heading of docs/config.md; `common` sets their common properties. A reader
// handles rows without a field.
template <class Common>
class RowAdder {
 public:
  RowAdder(Rows& rows, const char* section, Common common)
      : rows_(rows), section_(section), common_(common) {}

  void operator()(KeySpec spec, auto... field) const {
    spec.section = section_;
    common_(spec);
    (store_in(spec, +field), ...);
    if (spec.fallback) spec.type = type_of(*spec.fallback);
    rows_.push_back(std::move(spec));
  }
  // Adds a number whose default is the field's initial value. `unit` may be empty.
  void operator()(const char* key, NumberRange range, const char* unit, const char* help,
                  auto field) const {
    (*this)({.key = key, .range = range, .unit = unit, .help = help}, field);
  }

 private:
  Rows& rows_;
  const char* section_;
  Common common_;
};

inline auto row_adder(Rows& rows, const char* section) {
  return RowAdder(rows, section, [](KeySpec&) {});
}
// Adds rows that only this role uses.
inline auto row_adder(Rows& rows, const char* section, UsedBy used_by) {
  return RowAdder(rows, section, [used_by](KeySpec& spec) { spec.used_by = used_by; });
}

}  // namespace connect_bridge
