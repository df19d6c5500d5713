#include "ros/types/type_supports.hpp"

#include <dlfcn.h>
#include <rosidl_runtime_c/message_type_support_struct.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <utility>

#include "ros/rcl/distro.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/types/cdr_check.hpp"

namespace connect_bridge::ros {
namespace {

constexpr std::size_t kMissingMax = 1024;
constexpr std::chrono::seconds kMissingTime{10};

std::string library_name(const std::string& package) {
  return "lib" + package + "__rosidl_typesupport_c.so";
}

// The ament index finds the package; the loader's own search path is the fallback.
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

// The refusal if `type` here does not have the hash `wanted`; nullopt: it has.
std::optional<Refusal> mismatch(const std::string& type, const std::string& ours,
                                const std::string& wanted) {
  if (ours.empty() || wanted.empty() || ours == wanted) return std::nullopt;
  return Refusal{"type_mismatch",
                 "the definition of " + type + " here (" + ours + ") is not the peer's (" + wanted +
                     "): install the same version of its package on both sides",
                 ours};
}

// A pointer without ownership, for an installed type: libraries are never unloaded.
std::shared_ptr<const rosidl_message_type_support_t> without_end(
    const rosidl_message_type_support_t* handle) {
  return {std::shared_ptr<void>{}, handle};
}

}  // namespace

TypeSupports::TypeSupports(bool not_installed_too)
    : takes_bare_(not_installed_too && middleware().takes_bare_types) {}

std::variant<const MessageType*, Refusal> TypeSupports::installed(const std::string& type) {
  if (const auto found = messages_.find(type); found != messages_.end()) return &found->second;
  // A missing package is looked up again: it may be installed while the bridge runs.
  auto loaded = load(type, "message");
  if (auto* refusal = std::get_if<Refusal>(&loaded)) return std::move(*refusal);
  const auto* handle = static_cast<const rosidl_message_type_support_t*>(std::get<0>(loaded));
  return &messages_.emplace(type, MessageType{without_end(handle), introspection_of(handle)})
              .first->second;
}

TypeSupports::Message TypeSupports::message(const std::string& type, const std::string& hash,
                                            bool any_definition) {
  const auto found = installed(type);
  if (const auto* refusal = std::get_if<Refusal>(&found)) {
    const auto name = bare_name(type, hash, false);
    if (!name) return *refusal;
    auto made = bare_.message(*name, hash);
    if (auto* wrong = std::get_if<Refusal>(&made)) return std::move(*wrong);
    return MessageType{std::move(std::get<0>(made))};
  }
  MessageType here = *std::get<0>(found);
  if (hash.empty()) return here;
  auto refusal = mismatch(type, distro::type_hash_of(*here.handle), hash);
  // Messages of another definition must be checked, which needs the introspection.
  if (refusal && (!any_definition || !here.introspection)) return *std::move(refusal);
  if (refusal) here.other_hash = refusal->hash_here;
  return here;
}

std::optional<TypeLack> TypeSupports::lack_of(const std::string& type, const std::string& hash,
                                              bool is_service) {
  if (bare_name(type, hash, is_service)) return std::nullopt;
  const auto found = load(type, is_service ? "service" : "message");
  const auto* refusal = std::get_if<Refusal>(&found);
  return refusal ? std::optional(TypeLack{refusal->code, refusal->reason}) : std::nullopt;
}

bool TypeSupports::has_header(const std::string& type) {
  const auto found = installed(type);
  const auto* const* here = std::get_if<const MessageType*>(&found);
  return here && (*here)->introspection && begins_with_header(*(*here)->introspection);
}

TypeSupports::Service TypeSupports::service(const std::string& type, const std::string& hash,
                                            bool any_definition) {
  auto found = installed_service(type);
  if (const auto* refusal = std::get_if<Refusal>(&found)) {
    const auto name = bare_name(type, hash, true);
    return name ? bare_.service(*name, hash) : *refusal;
  }
  if (any_definition) return found;
  if (auto refusal = mismatch(type, std::get<0>(found)->hash, hash)) return *refusal;
  return found;
}

std::optional<TypeName> TypeSupports::bare_name(const std::string& type, const std::string& hash,
                                                bool is_service) const {
  if (!takes_bare_ || (hash.empty() && middleware().joins_by_hash)) return std::nullopt;
  auto name = parse_type_name(type);
  const bool of_service = is_service || (name && name->kind == "action");
  if (of_service && !middleware().takes_bare_services) return std::nullopt;
  return name;
}

TypeSupports::Service TypeSupports::installed_service(const std::string& type) {
  if (const auto found = services_.find(type); found != services_.end()) return found->second;
  auto loaded = load(type, "service");
  auto request = load(type + "_Request", "message");
  auto response = load(type + "_Response", "message");
  for (auto* part : {&loaded, &request, &response}) {
    if (auto* refusal = std::get_if<Refusal>(part)) return std::move(*refusal);
  }
  const auto part = [](const auto& handle) {
    return static_cast<const rosidl_message_type_support_t*>(std::get<0>(handle));
  };
  auto made = std::make_shared<ServiceType>();
  made->name = type;
  made->is_installed = true;
  made->handle = static_cast<const rosidl_service_type_support_t*>(std::get<0>(loaded));
  made->hash = distro::type_hash_of(*made->handle);
  made->request_hash = distro::type_hash_of(*part(request));
  made->response_hash = distro::type_hash_of(*part(response));
  made->request = installed_form(part(request));
  made->response = installed_form(part(response));
  if (!made->request || !made->response) {
    return Refusal{"type_unknown", "the installed package of " + type +
                                       " has no rosidl_typesupport_introspection_c: build it "
                                       "with this type support"};
  }
  return services_.emplace(type, std::move(made)).first->second;
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
  const auto name = parse_type_name(type);
  if (!name) {
    return Refusal{"type_unknown", "\"" + type + "\" is not a name of a " + kind + " type"};
  }
  void* library = bare_.uses(type) ? nullptr : library_of(name->package);
  if (library == nullptr) {
    std::string ros_package = name->package;
    std::replace(ros_package.begin(), ros_package.end(), '_', '-');
    return Refusal{"type_unknown", "the type " + name->to_install() +
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
                                       name->to_install() +
                                       ": install the version that the peer has"};
  }
  return handle;
}

}  // namespace connect_bridge::ros
