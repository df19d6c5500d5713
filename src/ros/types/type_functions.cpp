#include "ros/types/type_functions.hpp"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/config.h>
#include <rmw/rmw.h>

#include "ros/rcl/middleware.hpp"
#include "ros/rcl/rcl_result.hpp"
#include "ros/types/cdr_check.hpp"

namespace connect_bridge::ros {
namespace {

using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

// The value of rosidl_typesupport_fastrtps_c__identifier, without its library.
constexpr char kIdentifier[] = "rosidl_typesupport_fastrtps_c";

#if FASTCDR_VERSION_MAJOR >= 2
constexpr auto kVersion = eprosima::fastcdr::CdrVersion::XCDRv1;
#else
constexpr auto kVersion = Cdr::DDS_CDR;
#endif

std::size_t written_bytes(const Cdr& cdr) {
#if FASTCDR_VERSION_MAJOR >= 2
  return cdr.get_serialized_data_length();
#else
  return cdr.getSerializedDataLength();
#endif
}

void set_plain(Cdr& cdr) {
#if FASTCDR_VERSION_MAJOR >= 2
  cdr.set_encoding_flag(eprosima::fastcdr::EncodingAlgorithmFlag::PLAIN_CDR);
#else
  (void)cdr;
#endif
}

// The library takes no constant bytes, but only reads them here.
char* as_chars(const std::uint8_t* bytes) {
  return reinterpret_cast<char*>(const_cast<std::uint8_t*>(bytes));
}

}  // namespace

TypeFunctions::TypeFunctions(const rosidl_message_type_support_t& type) {
  if (!middleware().takes_bare_services) return;
  const auto* found = get_message_typesupport_handle(&type, kIdentifier);
  if (found == nullptr) {
    rcutils_reset_error();
  } else {
    functions_ = static_cast<const message_type_support_callbacks_t*>(found->data);
  }
}

bool TypeFunctions::write(const void* message, rmw_serialized_message_t& bytes) const {
  const std::size_t size = kCdrHeaderSize + functions_->get_serialized_size(message);
  if (bytes.buffer_capacity < size && !ignore_error(rmw_serialized_message_resize(&bytes, size)))
    return false;
  try {
    FastBuffer buffer(as_chars(bytes.buffer), bytes.buffer_capacity);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, kVersion);
    set_plain(cdr);
    cdr.serialize_encapsulation();
    if (!functions_->cdr_serialize(message, cdr)) return false;
    bytes.buffer_length = written_bytes(cdr);
    return true;
  } catch (...) {
    return false;
  }
}

bool TypeFunctions::read(ByteView bytes, void* message) const {
  try {
    FastBuffer buffer(as_chars(bytes.data()), bytes.size());
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, kVersion);
    cdr.read_encapsulation();
    return functions_->cdr_deserialize(cdr, message);
  } catch (...) {
    return false;
  }
}

}  // namespace connect_bridge::ros
