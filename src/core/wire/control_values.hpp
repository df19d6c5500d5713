// The values of a control message's JSON, in one list and in the order of the text. Reading costs
// little more than the message has bytes, whatever its shape.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace connect_bridge {

// A value; the values that it holds follow it in the list.
struct ControlValue {
  enum class Type : std::uint8_t { kNull, kBoolean, kUnsigned, kNumber, kText, kList, kObject };

  Type type = Type::kNull;
  std::string_view name{};   // of the member with this value; empty in a list
  std::uint32_t size = 1;    // of this value and all that it holds, in values
  std::uint64_t number = 0;  // kUnsigned; kBoolean: 0 or 1
  std::string_view text{};   // kText: valid UTF-8, without escapes

  // The members: for (auto* value = list.first(); value != list.last(); value = value->next()).
  [[nodiscard]] const ControlValue* first() const { return this + 1; }
  [[nodiscard]] const ControlValue* last() const { return this + size; }
  [[nodiscard]] const ControlValue* next() const { return this + size; }
};

// Reads the values within the limits of docs/protocol.md section 12. Values that no control message
// has are read and count, too.
class ControlValues {
 public:
  // An error: `text` is no JSON object (kMalformed), or beyond a limit (kTooLarge).
  [[nodiscard]] static Result<ControlValues> read(std::string_view text);

  [[nodiscard]] const ControlValue& object() const { return values_.front(); }

 private:
  class Events;

  std::vector<ControlValue> values_;
  std::vector<char> texts_;  // holds the names and texts of the values; does not grow
};

}  // namespace connect_bridge
