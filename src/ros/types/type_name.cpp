#include "ros/types/type_name.hpp"

#include <algorithm>
#include <string_view>

namespace connect_bridge::ros {
namespace {

bool is_identifier(std::string_view text) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  return !text.empty() && letter(text.front()) &&
         std::all_of(text.begin(), text.end(),
                     [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; });
}

}  // namespace

std::string TypeName::to_install() const {
  const auto end = kind == "action" ? name.find('_') : std::string::npos;
  return package + "/" + kind + "/" + name.substr(0, end);
}

std::optional<TypeName> parse_type_name(const std::string& type) {
  const auto first = type.find('/');
  const auto second = first == std::string::npos ? first : type.find('/', first + 1);
  if (second == std::string::npos) return std::nullopt;
  TypeName name{type.substr(0, first), type.substr(first + 1, second - first - 1),
                type.substr(second + 1)};
  const bool good = is_identifier(name.package) && is_identifier(name.kind) &&
                    is_identifier(name.name) && type.size() <= 255;
  return good ? std::optional{name} : std::nullopt;
}

}  // namespace connect_bridge::ros
