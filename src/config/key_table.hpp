// The table of all parameters. All texts about a parameter come from here: the check at start, the
// descriptors of `ros2 param describe` and docs/config.md.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "config/config.hpp"

namespace connect_bridge {

// Programs that have a parameter.
enum class UsedBy : std::uint8_t { kServer, kClient, kBoth };

// Checks a string (or each string of a list); nullopt: valid, else the expected form.
using Syntax = std::optional<std::string> (*)(std::string_view text);

// Stores a value that fits its row.
template <class Target>
using Store = std::function<void(Target& target, const ParameterValue& value)>;

// One row: everything that is known about a parameter.
struct KeySpec {
  std::string section{};  // heading in docs/config.md
  std::string key{};      // "listen.port"; keys of a rule are templates: "rule.<name>.priority"
  ParameterType type = ParameterType::kString;
  std::optional<ParameterValue> fallback{};  // the default; none: stays unset
  std::optional<NumberRange> range{};        // numbers
  std::vector<std::string> words{};          // strings: the allowed ones; empty: see `syntax`
  Syntax syntax = nullptr;
  UsedBy used_by = UsedBy::kBoth;
  bool changeable = false;  // while the program runs
  bool secret = false;      // never shown: no descriptor, no value in any text
  std::string unit{};       // "s", "bytes", "Hz" or empty
  std::string help{};       // one sentence
  // The function that stores the value; without one a reader handles the key.
  std::variant<std::monostate, Store<Config>, Store<Rule>> store{};
};

// Section of the keys with the rights of a rule; its other keys are the treatment.
inline constexpr char kRuleRights[] = "Keys of a rule: what it allows";

// All rows, in the order of docs/config.md.
[[nodiscard]] const std::vector<KeySpec>& key_table();

}  // namespace connect_bridge
