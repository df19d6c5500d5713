// The fields of a type that is known by its description only.
#pragma once

#include <rosidl_runtime_c/message_type_support_struct.h>
#include <rosidl_typesupport_introspection_c/message_introspection.h>

#include <deque>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "core/types/type_description.hpp"

namespace connect_bridge::ros {

// As the introspection type support of an installed type shows them, so that check_cdr() and what
// it costs are the same for both. It has nothing by which a message could be made in memory.
class DescribedFields {
 public:
  // nullptr: a kind of field is none that .msg files can have, so that nobody knows how it is
  // serialized.
  static std::unique_ptr<DescribedFields> make(TypeDescription description);
  DescribedFields(const DescribedFields&) = delete;
  DescribedFields& operator=(const DescribedFields&) = delete;

  // Lives as long as this.
  [[nodiscard]] const rosidl_message_type_support_t& introspection() const {
    return parts_.front().support;
  }
  // The same of a nested type: a request or response of a service. nullptr: there is none.
  [[nodiscard]] const rosidl_message_type_support_t* introspection(std::string_view nested) const;

 private:
  using Members = rosidl_typesupport_introspection_c__MessageMembers;
  using Member = rosidl_typesupport_introspection_c__MessageMember;
  struct Part {
    const DescribedType* type = nullptr;
    bool measured = false;
    std::vector<Member> fields;
    Members members{};
    rosidl_message_type_support_t support{};
  };

  explicit DescribedFields(TypeDescription description) : description_(std::move(description)) {}
  bool fill();
  bool fill(Part& part);
  Part& part_of(const DescribedType& type);
  // What a message takes in memory, at least: strings and sequences count as empty.
  std::size_t measure(Part& part);

  const TypeDescription description_;  // has the names
  std::deque<Part> parts_;             // the type itself, then the nested ones in their order
};

// What all users of a type that is not installed share, of one definition.
struct DescribedUse {
  std::unique_ptr<DescribedFields> fields = nullptr;  // null: not known, or not how to read them
  bool is_described = false;

  // What the first of them tells holds for all.
  void describe(const std::string& text);
};

}  // namespace connect_bridge::ros
