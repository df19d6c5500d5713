#include "core/policy/companion.hpp"

#include <algorithm>
#include <array>

#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

// FNV-1a.
std::uint64_t hash_of(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  constexpr std::uint64_t kPrime = 0x100000001b3;
  for (const char c : text) hash = (hash ^ static_cast<std::uint8_t>(c)) * kPrime;
  return hash;
}

std::string_view parent_of(std::string_view name) {
  return name.substr(0, std::min(name.rfind('/'), name.size()));
}

// The last token of a topic of image_transport or point_cloud_transport.
bool is_form(std::string_view token) {
  constexpr std::array<std::string_view, 8> kForms = {
      "compressed", "compressedDepth", "theora", "zstd", "zlib", "draco", "cloudini", "ffmpeg"};
  return std::find(kForms.begin(), kForms.end(), token) != kForms.end();
}

}  // namespace

Company company_of(std::string_view topic, std::string_view type, const Treatment& treatment) {
  const Priority by_type = default_priority(topic, type);
  const Priority priority = treatment.priority.value_or(by_type);
  if (treatment.with_large.value_or(type == "sensor_msgs/msg/CameraInfo"))
    return priority < Priority::kNormal ? Company::kNone : Company::kFollows;
  const bool large = by_type == Priority::kBulk || priority == Priority::kBulk;
  return large ? Company::kLarge : Company::kNone;
}

std::uint64_t company_namespace(std::string_view topic, Company company) {
  std::string_view base = parent_of(topic);
  if (company == Company::kLarge && is_form(topic.substr(base.size() + 1))) base = parent_of(base);
  return hash_of(base);
}

std::uint64_t company_node(std::string_view node) {
  return node.empty() ? 0 : hash_of(node);
}

}  // namespace connect_bridge
