#include "core/types/type_description.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/hex.hpp"
#include "core/base/sha256.hpp"
#include "core/wire/control.hpp"
#include "core/wire/control_shape.hpp"

namespace connect_bridge {
namespace {

using Json = nlohmann::json;

constexpr std::uint8_t kKinds = 22;

// The words of .msg files, by kind.
constexpr std::array<std::string_view, kKinds + 1> kKindNames{
    "?",     "?",      "int8",    "uint8",   "int16",       "uint16", "int32",  "uint32",
    "int64", "uint64", "float32", "float64", "long double", "char",   "wchar",  "bool",
    "byte",  "string", "wstring", "string",  "wstring",     "string", "wstring"};

bool is_word(std::string_view text) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  return !text.empty() && text.size() <= kNameBytesMax && letter(text.front()) &&
         std::all_of(text.begin(), text.end(),
                     [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; });
}

bool is_type_name(std::string_view text) {
  if (text.size() > kNameBytesMax) return false;
  const auto first = text.find('/');
  const auto last = text.rfind('/');
  return first != std::string_view::npos && first < last && is_word(text.substr(0, first)) &&
         is_word(text.substr(first + 1, last - first - 1)) && is_word(text.substr(last + 1));
}

bool has_string_capacity(FieldKind kind) {
  return kind >= FieldKind::kFixedString;
}

// Reads the members of the JSON; after the first error the rest is skipped. That nothing else is in
// the text, and in which order, is found by writing it again.
class Reading {
 public:
  std::string problem;

  TypeDescription description(const Json& json) {
    TypeDescription read;
    read.type = type(member(json, "type_description"));
    const Json& nested = list(json, "referenced_type_descriptions");
    if (nested.size() > kDescribedTypesMax) fail("it has too many types");
    for (const Json& entry : nested) {
      if (!problem.empty()) break;
      read.nested.push_back(type(entry));
    }
    return read;
  }

 private:
  void fail(const char* why) {
    if (problem.empty()) problem = why;
  }

  const Json& member(const Json& json, const char* key) {
    static const Json kNothing;
    const auto found = json.find(key);  // end() of what is no object
    if (found != json.end()) return *found;
    fail("a member is missing");
    return kNothing;
  }

  const Json& list(const Json& json, const char* key) {
    static const Json kEmpty = Json::array();
    const Json& found = member(json, key);
    if (found.is_array()) return found;
    fail("a member is no list");
    return kEmpty;
  }

  std::string text(const Json& json, const char* key) {
    const Json& found = member(json, key);
    if (const auto* value = found.get_ptr<const Json::string_t*>()) return *value;
    fail("a member is no text");
    return {};
  }

  std::uint32_t number(const Json& json, const char* key) {
    const Json& found = member(json, key);
    const auto* value = found.get_ptr<const Json::number_unsigned_t*>();
    if (value && *value <= std::numeric_limits<std::uint32_t>::max())
      return static_cast<std::uint32_t>(*value);
    fail("a member is no number of 32 bits");
    return 0;
  }

  DescribedType type(const Json& json) {
    DescribedType read{text(json, "type_name"), {}};
    if (!is_type_name(read.name)) fail("a name is no name of a type");
    const Json& fields = list(json, "fields");
    if (fields.empty()) fail("a type has no fields");
    fields_ += fields.size();
    if (fields_ > kDescribedFieldsMax) fail("it has too many fields");
    for (const Json& entry : fields) {
      if (!problem.empty()) break;
      read.fields.push_back(field(entry));
    }
    return read;
  }

  DescribedField field(const Json& json) {
    DescribedField read{text(json, "name")};
    if (!is_word(read.name)) fail("a name is no name of a field");
    const Json& type = member(json, "type");
    const std::uint32_t id = number(type, "type_id");
    const std::uint32_t kind = id % kFieldShapeStep;
    if (id / kFieldShapeStep > 3 || kind == 0 || kind > kKinds) {
      fail("a kind of field is not known");
      return read;
    }
    read.kind = static_cast<FieldKind>(kind);
    read.shape = static_cast<FieldShape>(id / kFieldShapeStep);
    read.capacity = number(type, "capacity");
    read.string_capacity = number(type, "string_capacity");
    read.nested = text(type, "nested_type_name");
    const bool counted =
        read.shape == FieldShape::kArray || read.shape == FieldShape::kBoundedSequence;
    if ((read.capacity != 0) != counted ||
        (read.string_capacity != 0) != has_string_capacity(read.kind))
      fail("a capacity does not fit its field");
    if ((read.kind == FieldKind::kNested) == read.nested.empty())
      fail("a nested type does not fit its field");
    return read;
  }

  std::size_t fields_ = 0;
};

// Whether all nested types are there, used, and end somewhere.
class Nesting {
 public:
  explicit Nesting(const TypeDescription& of) : of_(of), depths_(of.nested.size(), kNotSeen) {}

  [[nodiscard]] std::string_view problem() {
    for (std::size_t i = 0; i < of_.nested.size(); ++i) {
      if (i > 0 && of_.nested[i - 1].name >= of_.nested[i].name) return "types are not in order";
      if (of_.nested[i].name == of_.type.name) return "a type is there twice";
    }
    const std::size_t depth = depth_of(of_.type, 0);
    if (depth == kWrong) return wrong_;
    if (std::find(depths_.begin(), depths_.end(), kNotSeen) != depths_.end())
      return "a type is not used";
    return {};
  }

 private:
  static constexpr std::size_t kNotSeen = std::numeric_limits<std::size_t>::max();
  static constexpr std::size_t kOpen = kNotSeen - 1;
  static constexpr std::size_t kWrong = kNotSeen - 2;

  std::size_t wrong(std::string_view why) {
    wrong_ = why;
    return kWrong;
  }

  // How deep the types within this one go. `above`: how deep it is itself.
  std::size_t depth_of(const DescribedType& type, std::size_t above) {
    if (above > kDescribedDepthMax)
      return wrong("types are nested too deeply, or within themselves");
    std::size_t deepest = 0;
    for (const auto& field : type.fields) {
      if (field.kind != FieldKind::kNested) continue;
      const DescribedType* nested = of_.find(field.nested);
      if (!nested) return wrong("a nested type is missing");
      std::size_t& depth = depths_[static_cast<std::size_t>(nested - of_.nested.data())];
      if (depth == kOpen) return wrong("a type contains itself");
      if (depth == kNotSeen) {
        depth = kOpen;
        const std::size_t found = depth_of(*nested, above + 1);
        if (found == kWrong) return kWrong;
        depth = found;
      }
      deepest = std::max(deepest, depth + 1);
      if (above + deepest > kDescribedDepthMax) return wrong("types are nested too deeply");
    }
    return deepest;
  }

  const TypeDescription& of_;
  std::vector<std::size_t> depths_;
  std::string_view wrong_;
};

void append(std::string& text, const DescribedType& type) {
  text += R"({"type_name": ")" + type.name + R"(", "fields": [)";
  for (const auto& field : type.fields) {
    if (&field != type.fields.data()) text += ", ";
    const auto id = static_cast<unsigned>(field.kind) +
                    unsigned{kFieldShapeStep} * static_cast<unsigned>(field.shape);
    text += R"({"name": ")" + field.name + R"(", "type": {"type_id": )" + std::to_string(id);
    text += R"(, "capacity": )" + std::to_string(field.capacity);
    text += R"(, "string_capacity": )" + std::to_string(field.string_capacity);
    text += R"(, "nested_type_name": ")" + field.nested + "\"}}";
  }
  text += "]}";
}

Error refusal(std::string_view why) {
  return {CloseCode::kMalformed, "the description of a type is not usable: " + std::string{why}};
}

}  // namespace

const DescribedType* TypeDescription::find(std::string_view name) const {
  const auto at =
      std::lower_bound(nested.begin(), nested.end(), name,
                       [](const auto& entry, auto wanted) { return entry.name < wanted; });
  return at != nested.end() && at->name == name ? &*at : nullptr;
}

Result<TypeDescription> parse_description(std::string_view text) {
  if (text.size() > kDescriptionBytesMax) return refusal("it is too long");
  if (const auto shape = check_control_shape(text); !shape) return refusal("it is too complex");
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return refusal("it is no JSON");
  Reading reading;
  TypeDescription read = reading.description(json);
  if (!reading.problem.empty()) return refusal(reading.problem);
  if (const auto problem = Nesting(read).problem(); !problem.empty()) return refusal(problem);
  if (canonical_text(read) != text) return refusal("it is not in the canonical form");
  return read;
}

std::string canonical_text(const TypeDescription& description) {
  std::string text = R"({"type_description": )";
  append(text, description.type);
  text += R"(, "referenced_type_descriptions": [)";
  for (const auto& nested : description.nested) {
    if (&nested != description.nested.data()) text += ", ";
    append(text, nested);
  }
  return text + "]}";
}

std::string type_hash_of(std::string_view text) {
  const ByteView bytes{reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
  return "RIHS01_" + to_hex(sha256(bytes));
}

std::string shown(const DescribedField& field) {
  std::string text{kKindNames[static_cast<std::size_t>(field.kind)]};
  if (field.kind == FieldKind::kNested) text = field.nested;
  if (field.string_capacity > 0)
    text += (field.kind >= FieldKind::kBoundedString ? "<=" : "=") +
            std::to_string(field.string_capacity);
  switch (field.shape) {
    case FieldShape::kSingle: break;
    case FieldShape::kArray: text += "[" + std::to_string(field.capacity) + "]"; break;
    case FieldShape::kBoundedSequence: text += "[<=" + std::to_string(field.capacity) + "]"; break;
    case FieldShape::kSequence: text += "[]"; break;
  }
  return text;
}

}  // namespace connect_bridge
