#include "ros/rcl/missing_middleware.hpp"

#include <fmt/format.h>
#include <rmw/error_handling.h>
#include <rmw/rmw.h>

#include <cstdlib>
#include <filesystem>
#include <set>
#include <sstream>
#include <system_error>

#include "core/wire/text.hpp"

namespace connect_bridge::ros {
namespace {

constexpr std::size_t kNameShown = 100;  // bytes

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr ? value : "";
}

}  // namespace

std::vector<std::string> installed_middlewares(const std::string& prefixes) {
  std::set<std::string> names;
  std::istringstream all(prefixes);
  for (std::string prefix; std::getline(all, prefix, ':');) {
    std::error_code none;
    const std::filesystem::path index =
        prefix + "/share/ament_index/resource_index/rmw_typesupport";
    for (const auto& entry : std::filesystem::directory_iterator(index, none))
      names.insert(entry.path().filename());
  }
  names.erase("rmw_implementation");  // it chooses one of the others
  return {names.begin(), names.end()};
}

std::optional<MissingMiddleware> missing_middleware() {
  for (const char* const asked : kRmwVariables) {
    const std::string name = variable(asked);
    if (name.empty()) continue;
    const char* const loaded = rmw_get_implementation_identifier();
    if (loaded != nullptr && name == loaded) continue;
    rmw_reset_error();
    return MissingMiddleware{asked, name, installed_middlewares(variable("AMENT_PREFIX_PATH"))};
  }
  return std::nullopt;
}

std::string to_text(const MissingMiddleware& missing) {
  std::string text = missing.variable + "=" + connect_bridge::to_text(missing.name, kNameShown);
  if (!missing.installed.empty())
    text += fmt::format("; installed: {}", fmt::join(missing.installed, ", "));
  return text;
}

}  // namespace connect_bridge::ros
