#include "ros/types/bare_types.hpp"

#include <rosidl_runtime_c/string.h>
#include <rosidl_typesupport_fastrtps_cpp/service_type_support.h>
#include <rosidl_typesupport_introspection_c/field_types.h>
#include <rosidl_typesupport_introspection_c/identifier.h>
#include <rosidl_typesupport_fastrtps_cpp/identifier.hpp>

#include <algorithm>
#include <cstring>
#include <utility>

#include "ros/rcl/middleware.hpp"
#include "ros/types/bare_form.hpp"

namespace connect_bridge::ros {
namespace {

using rosidl_typesupport_fastrtps_cpp::typesupport_identifier;

Refusal no_hash(const TypeName& name, const std::string& hash) {
  return {"type_mismatch", "\"" + hash + "\" is not a hash of the type " + name.full()};
}

// A service type, with all objects that its handle points to.
struct BareService : ServiceType {
  BareService(const TypeName& of, const TypeHash& the_hash)
      : name_space(of.package + "::" + of.kind), service_name(of.name), support(the_hash) {}

  void connect() {
    callbacks = {name_space.c_str(), service_name.c_str(), requests.get(), responses.get()};
    support.typesupport_identifier = typesupport_identifier;
    support.data = &callbacks;
    support.func = [](const rosidl_service_type_support_t* self, const char* identifier) {
      return std::strcmp(identifier, typesupport_identifier) == 0 ? self : nullptr;
    };
    distro::set_parts(support, requests.get(), responses.get());
    handle = &support;
  }

  const std::string name_space, service_name;
  service_type_support_callbacks_t callbacks{};
  Hashed<rosidl_service_type_support_t> support;
  std::shared_ptr<const rosidl_message_type_support_t> requests, responses;
};

}  // namespace

BareMessageType::BareMessageType(TypeName name)
    : name_(std::move(name)),
      name_space_(name_.package + "::" + name_.kind),
      callbacks_{bare_callbacks()} {
  callbacks_.message_namespace_ = members_.message_namespace_ = name_space_.c_str();
  callbacks_.message_name_ = members_.message_name_ = name_.name.c_str();
  if (!middleware().asks_for_fields) return;
  // The fields are used only for messages that rmw_cyclonedds_cpp serializes itself, and there are
  // none. But it would lend memory for a structure of constant size, so this one has a string.
  static const rosidl_typesupport_introspection_c__MessageMember string = [] {
    rosidl_typesupport_introspection_c__MessageMember member{};
    member.name_ = "content";
    member.type_id_ = rosidl_typesupport_introspection_c__ROS_TYPE_STRING;
    return member;
  }();
  members_.members_ = &string;
  members_.member_count_ = 1;
  members_.size_of_ = sizeof(rosidl_runtime_c__String);
}

void BareMessageType::connect(Handle& handle) const {
  handle.typesupport_identifier = typesupport_identifier;
  handle.data = &callbacks_;
  handle.func = &find;
  handle.introspection.typesupport_identifier = rosidl_typesupport_introspection_c__identifier;
  handle.introspection.data = &members_;
  handle.introspection.func = [](const rosidl_message_type_support_t* self,
                                 const char* identifier) {
    const bool same = std::strcmp(identifier, rosidl_typesupport_introspection_c__identifier) == 0;
    return same ? self : nullptr;
  };
}

// Handles stay, and an unused one gets another hash. Peers may name any number of hashes, one after
// the other. A middleware may keep a pointer to a handle that nobody uses any longer.
BareMessageType::Handle& BareMessageType::handle_of(const std::string& text, const TypeHash& hash) {
  const auto known = handles_.find(text);
  if (known != handles_.end()) return known->second;
  const auto idle = std::find_if(handles_.begin(), handles_.end(),
                                 [](const auto& entry) { return entry.second.use.expired(); });
  if (idle == handles_.end()) {
    Handle& made = handles_.try_emplace(text, hash).first->second;
    connect(made);
    return made;
  }
  auto node = handles_.extract(idle);
  node.key() = text;
  node.mapped().hash = node.mapped().introspection.hash = hash;
  return handles_.insert(std::move(node)).position->second;
}

std::shared_ptr<const rosidl_message_type_support_t> BareMessageType::with_hash(
    const std::string& text, const TypeHash& hash) {
  Handle& handle = handle_of(text, hash);
  auto use = handle.use.lock();
  if (!use) handle.use = use = std::make_shared<Use>(Use{shared_from_this()});
  return {std::move(use), &handle};
}

const rosidl_message_type_support_t* BareMessageType::find(
    const rosidl_message_type_support_t* handle, const char* identifier) {
  if (std::strcmp(identifier, typesupport_identifier) == 0) return handle;
  const bool shown = distro::bare_types_need_introspection() || middleware().asks_for_fields;
  if (!shown || std::strcmp(identifier, rosidl_typesupport_introspection_c__identifier) != 0)
    return nullptr;
  return &static_cast<const Handle*>(handle)->introspection;
}

std::shared_ptr<BareMessageType> BareTypes::type(const TypeName& name) {
  std::string full = name.full();
  if (const auto found = types_.find(full); found != types_.end()) {
    if (auto type = found->second.lock()) return type;
  }
  std::erase_if(types_, [](const auto& entry) { return entry.second.expired(); });
  auto type = std::make_shared<BareMessageType>(name);
  types_.emplace(std::move(full), type);
  return type;
}

BareTypes::Message BareTypes::message(const TypeName& name, const std::string& hash) {
  const auto parsed = parse_type_hash(hash);
  if (!parsed) return no_hash(name, hash);
  return type(name)->with_hash(hash, *parsed);
}

BareTypes::Service BareTypes::service(const TypeName& name, const std::string& hash) {
  const auto parsed = parse_type_hash(hash);
  if (!parsed) return no_hash(name, hash);
  auto made = std::make_shared<BareService>(name, *parsed);
  made->name = name.full();
  made->hash = hash;
  // The middleware compares at most the hash of the service. The hashes of its parts are not known,
  // and rmw_fastrtps_cpp writes an error to the terminal if they are missing.
  const std::string nobodys = nobodys_hash();
  const TypeHash of_part = parse_type_hash(nobodys).value();
  const auto part = [&](const char* end) {
    return type({name.package, name.kind, name.name + end})->with_hash(nobodys, of_part);
  };
  made->requests = part("_Request");
  made->responses = part("_Response");
  made->connect();
  made->request = bare_form(made->name + "_Request");
  made->response = bare_form(made->name + "_Response");
  return Service{std::move(made)};
}

bool BareTypes::uses(std::string_view type) const {
  const auto found = types_.find(type);
  return found != types_.end() && !found->second.expired();
}

std::size_t BareTypes::size() const {
  return static_cast<std::size_t>(std::count_if(
      types_.begin(), types_.end(), [](const auto& entry) { return !entry.second.expired(); }));
}

}  // namespace connect_bridge::ros
