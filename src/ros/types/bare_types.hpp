// Type support for types whose packages are not installed, made at run time.
#pragma once

#include <rosidl_runtime_c/message_type_support_struct.h>
#include <rosidl_typesupport_fastrtps_cpp/message_type_support.h>
#include <rosidl_typesupport_introspection_c/message_introspection.h>

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include "ros/rcl/rcl_result.hpp"
#include "ros/types/hashed.hpp"
#include "ros/types/service_type.hpp"
#include "ros/types/type_name.hpp"

namespace connect_bridge::ros {

// A message type known only by its name, and by a hash if the peer or the graph has one. The
// middleware keeps the first type support of a type's name as long as any endpoint has that type.
// So there is one object per name, and it lives as long as any user of it.
class BareMessageType : public std::enable_shared_from_this<BareMessageType> {
 public:
  explicit BareMessageType(TypeName name);
  BareMessageType(const BareMessageType&) = delete;
  BareMessageType& operator=(const BareMessageType&) = delete;

  // The handle for rcl. The handle lives as long as this object, and keeps its hash while anybody
  // uses it.
  std::shared_ptr<const rosidl_message_type_support_t> with_hash(const std::string& text,
                                                                 const TypeHash& hash);

 private:
  // Shared by the users of one hash. The last of them may go long before the last user of the name.
  struct Use {
    std::shared_ptr<BareMessageType> type;
  };
  struct Handle : Hashed<rosidl_message_type_support_t> {
    explicit Handle(const TypeHash& the_hash) : Hashed(the_hash), introspection(the_hash) {}

    // Handle for middlewares that read the fields (distro.hpp, Middleware::asks_for_fields).
    Hashed<rosidl_message_type_support_t> introspection;
    std::weak_ptr<Use> use;
  };

  Handle& handle_of(const std::string& text, const TypeHash& hash);
  void connect(Handle& handle) const;
  static const rosidl_message_type_support_t* find(const rosidl_message_type_support_t* handle,
                                                   const char* identifier);

  const TypeName name_;
  const std::string name_space_;  // "std_msgs::msg"
  message_type_support_callbacks_t callbacks_;
  rosidl_typesupport_introspection_c__MessageMembers members_{};
  std::map<std::string, Handle> handles_;
};

// Types for middlewares that accept them (Middleware::takes_bare_types, takes_bare_services).
// Returned objects may outlive this object. Thread: the loop's.
class BareTypes {
 public:
  using Message = std::variant<std::shared_ptr<const rosidl_message_type_support_t>, Refusal>;
  using Service = std::variant<std::shared_ptr<ServiceType>, Refusal>;

  // Type support for endpoints that carry bytes. `hash` is "RIHS01_..." or empty. A Refusal has the
  // code "type_mismatch": the hash is not valid.
  Message message(const TypeName& name, const std::string& hash);
  Service service(const TypeName& name, const std::string& hash);

  // The type of this full name is in use. Meanwhile the middleware keeps the type support made
  // here, even if the package is installed later.
  [[nodiscard]] bool uses(std::string_view type) const;
  // Number of message types in use, including those of requests and responses.
  [[nodiscard]] std::size_t size() const;

 private:
  std::shared_ptr<BareMessageType> type(const TypeName& name);

  std::map<std::string, std::weak_ptr<BareMessageType>, std::less<>> types_;  // by full name
};

}  // namespace connect_bridge::ros
