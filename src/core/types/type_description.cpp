#include "core/types/type_description.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "core/base/hex.hpp"
#include "core/base/sha256.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {
namespace {

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

// The canonical form is the one text of a description that is hashed: members in this order, one
// blank behind each ':' and ',', no escapes, the nested types in the order of their names. It reads
// that and nothing else, which takes a hundredth of the time of any JSON: a hostile text may have
// its full length. After the first problem the rest is skipped.
class Reading {
 public:
  explicit Reading(std::string_view text) : rest_(text) {}

  TypeDescription description() {
    TypeDescription read;
    literal(R"({"type_description": )");
    read.type = type();
    literal(R"(, "referenced_type_descriptions": [)");
    list([&] {
      if (read.nested.size() == kDescribedTypesMax) return fail("it has too many types");
      read.nested.push_back(type());
    });
    literal("}");
    if (!rest_.empty()) fail(kNotCanonical);
    return read;
  }
  // Empty: none.
  [[nodiscard]] std::string_view problem() const { return problem_; }

 private:
  static constexpr std::string_view kNotCanonical = "it is not in the canonical form";

  void fail(std::string_view why) {
    if (problem_.empty()) problem_ = why;
    rest_ = {};
  }

  bool accept(std::string_view word) {
    if (!rest_.starts_with(word)) return false;
    rest_.remove_prefix(word.size());
    return true;
  }
  void literal(std::string_view word) {
    if (!accept(word)) fail(kNotCanonical);
  }

  // Up to the end of a list.
  template <class Item>
  void list(const Item& item) {
    if (accept("]")) return;
    do item();
    while (accept(", "));
    literal("]");
  }

  // Up to the end of a string. The caller checks that it is a name, without escapes.
  std::string_view text() {
    const auto end = rest_.find('"');
    if (end == std::string_view::npos) {
      fail(kNotCanonical);
      return {};
    }
    const auto found = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return found;
  }

  std::uint32_t number() {
    // No number of 32 bits has more, so the value cannot overflow 64 bits before it is judged.
    constexpr std::size_t kDigitsMax = 10;
    const auto end = std::min(rest_.find_first_not_of("0123456789"), rest_.size());
    std::uint64_t value = 0;
    for (const char digit : rest_.substr(0, std::min(end, kDigitsMax)))
      value = 10 * value + static_cast<std::uint64_t>(digit - '0');
    const bool plain = end == 1 || (end > 1 && end <= kDigitsMax && rest_.front() != '0');
    if (!plain || value > std::numeric_limits<std::uint32_t>::max()) {
      fail("a number is not one of 32 bits");
      return 0;
    }
    rest_.remove_prefix(end);
    return static_cast<std::uint32_t>(value);
  }

  DescribedType type() {
    literal(R"({"type_name": ")");
    DescribedType read{std::string{text()}, {}};
    if (!is_type_name(read.name)) fail("a name is no name of a type");
    literal(R"(, "fields": [)");
    list([&] {
      if (++fields_ > kDescribedFieldsMax) return fail("it has too many fields");
      read.fields.push_back(field());
    });
    // An empty message has one, too: structure_needs_at_least_one_member.
    if (read.fields.empty()) fail("a type has no fields");
    literal("}");
    return read;
  }

  DescribedField field() {
    literal(R"({"name": ")");
    DescribedField read{std::string{text()}};
    if (!is_word(read.name)) fail("a name is no name of a field");
    literal(R"(, "type": {"type_id": )");
    const std::uint32_t id = number();
    literal(R"(, "capacity": )");
    read.capacity = number();
    literal(R"(, "string_capacity": )");
    read.string_capacity = number();
    literal(R"(, "nested_type_name": ")");
    read.nested = text();
    literal("}}");
    check(read, id);
    return read;
  }

  void check(DescribedField& field, std::uint32_t id) {
    const std::uint32_t kind = id % kFieldShapeStep;
    if (id / kFieldShapeStep > 3 || kind == 0 || kind > kKinds)
      return fail("a kind of field is not known");
    field.kind = static_cast<FieldKind>(kind);
    field.shape = static_cast<FieldShape>(id / kFieldShapeStep);
    const bool counted =
        field.shape == FieldShape::kArray || field.shape == FieldShape::kBoundedSequence;
    if ((field.capacity != 0) != counted ||
        (field.string_capacity != 0) != has_string_capacity(field.kind))
      fail("a capacity does not fit its field");
    if ((field.kind == FieldKind::kNested) != is_type_name(field.nested) ||
        (field.kind != FieldKind::kNested && !field.nested.empty()))
      fail("a nested type does not fit its field");
  }

  std::string_view rest_;
  std::string_view problem_;
  std::size_t fields_ = 0;
};

// Whether all nested types are there, used, and end somewhere.
class Nesting {
 public:
  explicit Nesting(const TypeDescription& of) : of_(of), depths_(of.nested.size(), kNotSeen) {}

  [[nodiscard]] std::string_view problem() {
    // First their order: find() relies on it.
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
      // Each type is looked into once, and its depth remembered: with types that each use the next
      // one twice, the number of ways through them doubles with each.
      if (depth == kNotSeen) {
        depth = kOpen;
        const std::size_t found = depth_of(*nested, above + 1);
        if (found == kWrong) return kWrong;
        depth = found;
      }
      deepest = std::max(deepest, depth + 1);
      // Also for a type whose depth was found elsewhere: here it may be deeper down.
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
  Reading reading(text);
  TypeDescription read = reading.description();
  if (!reading.problem().empty()) return refusal(reading.problem());
  if (const auto problem = Nesting(read).problem(); !problem.empty()) return refusal(problem);
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
