// Type support of types whose packages are not installed, made at run time.
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

// A message type of which only the name is known, and a hash if the peer or the graph gives one.
// The middleware keeps the first type support that it got for a type's name as long as any endpoint
// has that type, so there is one of these per name, and it lives as long as any user of it.
class BareMessageType : public std::enable_shared_from_this<BareMessageType> {
 public:
  explicit BareMessageType(TypeName name);
  BareMessageType(const BareMessageType&) = delete;
  BareMessageType& operator=(const BareMessageType&) = delete;

  // For rcl. It lives as long as this, and has this hash as long as anybody uses it.
  std::shared_ptr<const rosidl_message_type_support_t> with_hash(const std::string& text,
                                                                 const TypeHash& hash);

 private:
  // What the users of one hash share. The last of them may go long before the last user of the
  // name.
  struct Use {
    std::shared_ptr<BareMessageType> type;
  };
  struct Handle : Hashed<rosidl_message_type_support_t> {
    explicit Handle(const TypeHash& the_hash) : Hashed(the_hash), introspection(the_hash) {}

    // For middlewares that read it (distro.hpp, Middleware::asks_for_fields).
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

// Works with middlewares that take such types (Middleware::takes_bare_types, takes_bare_services).
// Thread: the loop's. What it hands out may live longer than this.
class BareTypes {
 public:
  using Message = std::variant<std::shared_ptr<const rosidl_message_type_support_t>, Refusal>;
  using Service = std::variant<std::shared_ptr<ServiceType>, Refusal>;

  // Type support for endpoints that carry bytes. `hash` is "RIHS01_..." or empty. A Refusal has the
  // code "type_mismatch": the hash is not valid.
  Message message(const TypeName& name, const std::string& hash);
  Service service(const TypeName& name, const std::string& hash);

  // Whether the type of this full name is in use. While it is, the middleware keeps what was made
  // here, also if its package is installed meanwhile.
  [[nodiscard]] bool uses(std::string_view type) const;
  // How many types of messages are in use, those of requests and responses among them.
  [[nodiscard]] std::size_t size() const;

 private:
  std::shared_ptr<BareMessageType> type(const TypeName& name);

  std::map<std::string, std::weak_ptr<BareMessageType>, std::less<>> types_;  // by full name
};

}  // namespace connect_bridge::ros
