// Type support by a type's name: from the shared libraries of installed packages, or made at run
// time.
#pragma once

#include <rosidl_runtime_c/message_type_support_struct.h>

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "core/ports/inputs.hpp"
#include "ros/rcl/rcl_result.hpp"
#include "ros/types/bare_types.hpp"
#include "ros/types/service_type.hpp"
#include "ros/types/type_name.hpp"

namespace connect_bridge::ros {

struct MessageType {
  std::shared_ptr<const rosidl_message_type_support_t> handle;  // for rcl; outlives its endpoints
  // Describes the fields, for check_cdr(). nullptr: the type is not installed.
  const rosidl_message_type_support_t* introspection = nullptr;
  // Not empty: the installed definition has this hash, not the requested one.
  std::string other_hash = {};
};

// Finds or makes type support. A Refusal has the code "type_unknown" or "type_mismatch". Libraries
// are never unloaded, because the middleware keeps references to type support; type support made at
// run time is freed with its last user. Thread: the loop's.
class TypeSupports {
 public:
  using Message = std::variant<MessageType, Refusal>;
  using Service = std::variant<std::shared_ptr<ServiceType>, Refusal>;

  // `not_installed_too`: types whose packages are not installed are made at run time, if the
  // middleware can use them (bare_types.hpp).
  explicit TypeSupports(bool not_installed_too = false);

  // The type support of "std_msgs/msg/String". A `hash` that is not empty ("RIHS01_...") must be
  // the hash of the installed definition, if the distribution has hashes; a type that is not
  // installed gets this hash. `any_definition`: the installed definition may have another hash.
  Message message(const std::string& type, const std::string& hash, bool any_definition = false);
  // The same for a service: "std_srvs/srv/SetBool" or "<package>/action/<Action>_SendGoal".
  Service service(const std::string& type, const std::string& hash, bool any_definition = false);

  // The reason why no subscription to such a type can be made; with `is_service`, no client.
  // nullopt: no reason is known before a try. Uses no memory but for the package's library.
  std::optional<TypeLack> lack_of(const std::string& type, const std::string& hash,
                                  bool is_service);

  // The type is installed and begins with a std_msgs/msg/Header.
  bool has_header(const std::string& type);

  // Number of message types in use that are not installed.
  [[nodiscard]] std::size_t made() const { return bare_.size(); }

 private:
  // An installed type, or the reason why there is none.
  std::variant<const MessageType*, Refusal> installed(const std::string& type);
  Service installed_service(const std::string& type);
  // The name of a type that is not installed and can be made at run time; nullopt: it cannot. The
  // types of an action are made only if its services' types can be: half an action is useless.
  [[nodiscard]] std::optional<TypeName> bare_name(const std::string& type, const std::string& hash,
                                                  bool is_service) const;
  // The result of a function of the package of `type`; `kind` is "message" or "service".
  std::variant<const void*, Refusal> load(const std::string& type, const std::string& kind);

  // The library of a package; null: not installed.
  void* library_of(const std::string& package);

  const bool takes_bare_;
  BareTypes bare_;
  // Installed types and their libraries.
  std::map<std::string, MessageType, std::less<>> messages_;
  std::map<std::string, std::shared_ptr<ServiceType>, std::less<>> services_;
  std::map<std::string, void*, std::less<>> libraries_;  // by package
  // Packages that were not found, and the time of the next search. A peer may request any name, and
  // each search reads the file system.
  std::map<std::string, std::chrono::steady_clock::time_point, std::less<>> missing_;
};

}  // namespace connect_bridge::ros
