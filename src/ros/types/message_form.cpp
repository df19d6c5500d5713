#include "ros/types/message_form.hpp"

#include <rmw/rmw.h>
#include <rosidl_runtime_c/message_initialization.h>
#include <rosidl_typesupport_introspection_c/identifier.h>
#include <rosidl_typesupport_introspection_c/message_introspection.h>

#include "ros/rcl/middleware.hpp"
#include "ros/rcl/rcl_result.hpp"
#include "ros/rcl/take_buffer.hpp"
#include "ros/types/cdr_check.hpp"
#include "ros/types/type_functions.hpp"

namespace connect_bridge::ros {
namespace {

using Members = rosidl_typesupport_introspection_c__MessageMembers;

// Strings and sequences of the last message are reused for the next one, up to this size.
constexpr std::size_t kKeptBytes = 64U << 10;

class InstalledForm final : public MessageForm {
 public:
  InstalledForm(const rosidl_message_type_support_t* type,
                const rosidl_message_type_support_t* introspection)
      : type_(type),
        functions_(*type),
        introspection_(introspection),
        members_(*static_cast<const Members*>(introspection->data)),
        memory_(::operator new(members_.size_of_)) {
    init();
  }

  ~InstalledForm() override {
    members_.fini_function(memory_);
    ::operator delete(memory_);
  }

  void* message() override { return memory_; }

  std::optional<std::string> write_to(rmw_serialized_message_t& bytes) override {
    const rmw_ret_t result = serialize(bytes);
    size_ = bytes.buffer_length;
    const auto what = [this] {
      return std::string{"cannot serialize a "} + members_.message_name_;
    };
    if (result != RMW_RET_OK) {
      clear();
      return error_text(what(), result);
    }
    std::string problem;
    const auto end = clear_padding({bytes.buffer, bytes.buffer_length}, *introspection_, problem);
    if (!end) return what() + ": " + problem;
    bytes.buffer_length = *end;
    return std::nullopt;
  }

  std::optional<std::string> read_from(ByteView bytes, std::size_t memory_max) override {
    if (auto problem = check_cdr(bytes, *introspection_, call_limits(memory_max))) {
      return std::string{"not a "} + members_.message_name_ + ": " + *problem;
    }
    size_ = bytes.size();
    const rmw_ret_t result = deserialize(bytes);
    if (result == RMW_RET_OK) return std::nullopt;
    auto text = error_text(std::string{"not a "} + members_.message_name_, result);
    clear();
    return text;
  }

  void reset() override {
    if (size_ > kKeptBytes || !middleware().fills_used_messages) clear();
    size_ = 0;
  }

 private:
  rmw_ret_t serialize(rmw_serialized_message_t& bytes) {
    if (!functions_) return rmw_serialize(memory_, type_, &bytes);
    return functions_.write(memory_, bytes) ? RMW_RET_OK : RMW_RET_ERROR;
  }
  rmw_ret_t deserialize(ByteView bytes) {
    if (functions_) return functions_.read(bytes, memory_) ? RMW_RET_OK : RMW_RET_ERROR;
    const rmw_serialized_message_t message = as_serialized(bytes);
    try {
      return rmw_deserialize(&message, type_, memory_);
    } catch (...) {  // not every middleware catches exceptions of its CDR library
      return RMW_RET_ERROR;
    }
  }
  void init() { members_.init_function(memory_, ROSIDL_RUNTIME_C_MSG_INIT_ALL); }
  void clear() {
    members_.fini_function(memory_);
    init();
  }

  const rosidl_message_type_support_t* const type_;
  const TypeFunctions functions_;
  const rosidl_message_type_support_t* const introspection_;
  const Members& members_;
  void* const memory_;
  std::size_t size_ = 0;  // bytes of the message, about the size of its memory
};

}  // namespace

std::unique_ptr<MessageForm> installed_form(const rosidl_message_type_support_t* type) {
  const auto* introspection = introspection_of(type);
  if (introspection == nullptr) return nullptr;
  return std::make_unique<InstalledForm>(type, introspection);
}

}  // namespace connect_bridge::ros
