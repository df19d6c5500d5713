#include "ros/types/type_supports.hpp"

#include <dlfcn.h>
#include <rosidl_runtime_c/message_type_support_struct.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "ros/rcl/distro.hpp"

namespace connect_bridge::ros {
namespace {

constexpr std::size_t kMissingMax = 1024;
constexpr std::chrono::seconds kMissingTime{10};

struct TypeName {
  std::string package, kind, name;
};

bool is_identifier(std::string_view text) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  return !text.empty() && letter(text.front()) &&
         std::all_of(text.begin(), text.end(),
                     [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; });
}

// A peer may have chosen the name, and it becomes part of a file name.
std::optional<TypeName> parse(const std::string& type) {
  const auto first = type.find('/');
  const auto second = first == std::string::npos ? first : type.find('/', first + 1);
  if (second == std::string::npos) return std::nullopt;
  TypeName name{type.substr(0, first), type.substr(first + 1, second - first - 1),
                type.substr(second + 1)};
  const bool good = is_identifier(name.package) && is_identifier(name.kind) &&
                    is_identifier(name.name) && type.size() <= 255;
  return good ? std::optional{name} : std::nullopt;
}

std::string library_name(const std::string& package) {
#ifdef __APPLE__
  return "lib" + package + "__rosidl_typesupport_c.dylib";
#else
  return "lib" + package + "__rosidl_typesupport_c.so";
#endif
}

// The ament index tells where a package is installed; the loader's own search path is the fallback.
void* open_library(const std::string& package) {
  namespace fs = std::filesystem;
  const char* variable = std::getenv("AMENT_PREFIX_PATH");
  std::string_view paths = variable ? variable : "";
  while (!paths.empty()) {
    const auto end = std::min(paths.find(':'), paths.size());
    const fs::path prefix{paths.substr(0, end)};
    paths.remove_prefix(std::min(end + 1, paths.size()));
    if (prefix.empty()) continue;
    std::error_code ignored;
    if (!fs::exists(prefix / "share/ament_index/resource_index/packages" / package, ignored)) {
      continue;
    }
    const fs::path file = prefix / "lib" / library_name(package);
    if (void* library = dlopen(file.c_str(), RTLD_LAZY | RTLD_LOCAL)) return library;
  }
  return dlopen(library_name(package).c_str(), RTLD_LAZY | RTLD_LOCAL);
}

// What a person must look for: of the types that ROS derives from an action's, the action's own.
std::string to_install(const TypeName& type) {
  const auto end = type.kind == "action" ? type.name.find('_') : std::string::npos;
  return type.package + "/" + type.kind + "/" + type.name.substr(0, end);
}

// Nothing, or why `type` here is not the one with the hash `wanted`.
std::optional<Refusal> mismatch(const std::string& type, const std::string& ours,
                                const std::string& wanted) {
  if (ours.empty() || wanted.empty() || ours == wanted) return std::nullopt;
  return Refusal{"type_mismatch", "the definition of " + type + " here (" + ours +
                                      ") is not the peer's (" + wanted +
                                      "): install the same version of its package on "
                                      "both sides"};
}

}  // namespace

TypeSupports::MessageType TypeSupports::message(const std::string& type, const std::string& hash) {
  auto found = messages_.find(type);
  if (found == messages_.end()) {
    MessageType loaded = load_message(type);
    // A missing package is looked for again: it may be installed while we run.
    if (std::holds_alternative<Refusal>(loaded)) return loaded;
    found = messages_.emplace(type, std::move(loaded)).first;
  }
  const auto* handle = std::get<0>(found->second);
  if (hash.empty()) return handle;
  if (auto refusal = mismatch(type, distro::type_hash_of(*handle), hash)) return *refusal;
  return handle;
}

TypeSupports::Service TypeSupports::service(const std::string& type, const std::string& hash) {
  auto found = services_.find(type);
  if (found == services_.end()) {
    auto loaded = load_service(type);
    if (auto* refusal = std::get_if<Refusal>(&loaded)) return *refusal;
    found = services_.emplace(type, std::move(std::get<0>(loaded))).first;
  }
  if (auto refusal = mismatch(type, found->second->hash, hash)) return *refusal;
  return found->second.get();
}

TypeSupports::MessageType TypeSupports::load_message(const std::string& type) {
  auto loaded = load(type, "message");
  if (auto* refusal = std::get_if<Refusal>(&loaded)) return std::move(*refusal);
  return static_cast<const rosidl_message_type_support_t*>(std::get<0>(loaded));
}

std::variant<std::unique_ptr<ServiceType>, Refusal> TypeSupports::load_service(
    const std::string& type) {
  auto loaded = load(type, "service");
  auto request = load(type + "_Request", "message");
  auto response = load(type + "_Response", "message");
  for (auto* part : {&loaded, &request, &response}) {
    if (auto* refusal = std::get_if<Refusal>(part)) return std::move(*refusal);
  }
  const auto form = [](const void* handle) {
    return installed_form(static_cast<const rosidl_message_type_support_t*>(handle));
  };
  auto made = std::make_unique<ServiceType>();
  made->name = type;
  made->handle = static_cast<const rosidl_service_type_support_t*>(std::get<0>(loaded));
  made->hash = distro::type_hash_of(*made->handle);
  made->request = form(std::get<0>(request));
  made->response = form(std::get<0>(response));
  if (!made->request || !made->response) {
    return Refusal{"type_unknown", "the installed package of " + type +
                                       " has no rosidl_typesupport_introspection_c: build it "
                                       "with this type support"};
  }
  return made;
}

void* TypeSupports::library_of(const std::string& package) {
  if (const auto known = libraries_.find(package); known != libraries_.end()) return known->second;
  const auto now = std::chrono::steady_clock::now();
  if (const auto missing = missing_.find(package); missing != missing_.end()) {
    if (now < missing->second) return nullptr;
    missing_.erase(missing);
  }
  if (void* opened = open_library(package)) return libraries_[package] = opened;
  if (missing_.size() >= kMissingMax) missing_.clear();
  missing_[package] = now + kMissingTime;
  return nullptr;
}

std::variant<const void*, Refusal> TypeSupports::load(const std::string& type,
                                                      const std::string& kind) {
  const auto name = parse(type);
  if (!name) {
    return Refusal{"type_unknown", "\"" + type + "\" is not a name of a " + kind + " type"};
  }
  void* library = library_of(name->package);
  if (library == nullptr) {
    std::string ros_package = name->package;
    std::replace(ros_package.begin(), ros_package.end(), '_', '-');
    return Refusal{"type_unknown", "the type " + to_install(*name) +
                                       " is not known here: install the package " + name->package +
                                       " (ros-<distro>-" + ros_package +
                                       ") or source the workspace that has it"};
  }
  const std::string symbol = "rosidl_typesupport_c__get_" + kind + "_type_support_handle__" +
                             name->package + "__" + name->kind + "__" + name->name;
  using Function = const void* (*)();
  const auto function = reinterpret_cast<Function>(dlsym(library, symbol.c_str()));
  const void* handle = function ? function() : nullptr;
  if (handle == nullptr) {
    return Refusal{"type_unknown", "the installed package " + name->package + " has no type " +
                                       to_install(*name) +
                                       ": install the version that the peer has"};
  }
  return handle;
}

}  // namespace connect_bridge::ros
