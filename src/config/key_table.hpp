// The table of all parameters. All texts about a parameter come from here: the check at start, the
// descriptors of `ros2 param describe` and docs/config.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/parameter.hpp"
#include "core/side/side.hpp"

namespace connect_bridge {

inline constexpr double kGiB = 1024.0 * 1024.0 * 1024.0;  // in bytes, for the ranges

enum class UsedBy : std::uint8_t { kServer, kClient, kBoth };

// Checks a string (or each string of a list); nullopt: valid, else what was expected.
using Syntax = std::optional<std::string> (*)(std::string_view text);

struct KeySpec {
  std::string section{};  // heading in docs/config.md
  std::string key{};      // "listen.port"; keys of a rule are templates: "rule.<name>.priority"
  ParameterType type = ParameterType::kString;  // with a default: the default's
  std::optional<ParameterValue> fallback{};     // the default; none: stays unset
  std::optional<NumberRange> range{};           // numbers
  std::vector<std::string> words{};             // strings: the allowed ones; empty: see `syntax`
  Syntax syntax = nullptr;
  UsedBy used_by = UsedBy::kBoth;
  bool changeable = false;  // at run time
  bool secret = false;      // never shown: no descriptor, no value in any text
  std::string unit{};       // "s", "bytes", "Hz" or empty
  std::string help{};       // one sentence
};

// Adds rows under one heading of docs/config.md. `rows` and `section` must outlive what it returns.
[[nodiscard]] inline auto section_adder(std::vector<KeySpec>& rows, const char* section) {
  return [&rows, section](KeySpec spec) {
    spec.section = section;
    if (spec.fallback) spec.type = type_of(*spec.fallback);
    rows.push_back(std::move(spec));
  };
}

[[nodiscard]] const std::vector<KeySpec>& key_table();

}  // namespace connect_bridge
