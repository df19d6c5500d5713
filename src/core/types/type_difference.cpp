#include "core/types/type_difference.hpp"

#include <algorithm>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/wire/text.hpp"

namespace connect_bridge {
namespace {

using FieldsByName = std::unordered_map<std::string_view, const DescribedField*>;

FieldsByName by_name(const DescribedType& type) {
  FieldsByName fields;
  for (const auto& field : type.fields) fields.emplace(field.name, &field);
  return fields;
}

// Names may have 255 bytes each.
std::string cut(std::string text) {
  constexpr std::size_t kShownMax = 64;
  if (text.size() <= kShownMax) return text;
  return text.substr(0, kShownMax - 3) + "...";
}

class Differences {
 public:
  void compare(const DescribedType& here, const DescribedType& there, const std::string& prefix) {
    const auto ours = by_name(here);
    const auto theirs = by_name(there);
    for (const auto& field : there.fields)
      if (!ours.contains(field.name))
        add(prefix + only(field) + " is only in the peer's definition");
    for (const auto& field : here.fields)
      if (!theirs.contains(field.name))
        add(prefix + only(field) + " is only in the definition here");
    for (const auto& field : here.fields) {
      const auto other = theirs.find(field.name);
      if (other == theirs.end() || *other->second == field) continue;
      add(prefix + "'" + cut(field.name) + "' is " + cut(shown(field)) + " here and " +
          cut(shown(*other->second)) + " there");
    }
    const auto common = [](const DescribedType& type, const FieldsByName& other) {
      std::vector<std::string_view> names;
      for (const auto& field : type.fields)
        if (other.contains(field.name)) names.push_back(field.name);
      return names;
    };
    // A sample has no names of fields: in another order its bytes mean something else.
    if (common(here, theirs) != common(there, ours)) add(prefix + "fields are in another order");
  }

  [[nodiscard]] std::string text() const {
    if (texts_.empty()) return "none that a description shows";
    std::string line;
    for (std::size_t i = 0; i < texts_.size(); ++i) {
      const std::string more = "; " + std::to_string(texts_.size() - i) + " more differences";
      // Behind each there must be room to say how many are left out.
      if (line.size() + texts_[i].size() + more.size() + 2 > kDifferenceBytesMax)
        return line + more;
      if (i > 0) line += "; ";
      line += texts_[i];
    }
    return line;
  }

 private:
  static std::string only(const DescribedField& field) {
    return "the field '" + cut(field.name) + "' (" + cut(shown(field)) + ")";
  }
  void add(std::string text) { texts_.push_back(std::move(text)); }

  std::vector<std::string> texts_;
};

}  // namespace

std::string shortened_hash(const std::string& hash) {
  constexpr std::size_t kShownMax = 15;
  return hash.size() <= kShownMax ? hash : to_text(hash, kShownMax) + "...";
}

std::string difference(const TypeDescription& here, const TypeDescription& there) {
  Differences found;
  found.compare(here.type, there.type, {});
  // A nested type of one side only is used by a field that was named.
  for (const auto& nested : here.nested)
    if (const DescribedType* other = there.find(nested.name))
      found.compare(nested, *other, cut(nested.name) + ": ");
  return found.text();
}

}  // namespace connect_bridge
