#include "ros/rcl/rcl_result.hpp"

#include <rcl/error_handling.h>

#include "ros/node/node.hpp"

namespace connect_bridge::ros {

std::string error_text(const std::string& what, rcl_ret_t code) {
  std::string text = what + ": ";
  if (rcl_error_is_set()) {
    text += rcl_get_error_string().str;
    rcl_reset_error();
  } else {
    text += "rcl error " + std::to_string(code);
  }
  return text;
}

Refusal failure(const std::string& what, rcl_ret_t code) {
  return {"failed", error_text(what, code)};
}

bool ignore_error(rcl_ret_t code) {
  if (rcl_error_is_set()) rcl_reset_error();
  return code == RCL_RET_OK;
}

void require_ok(rcl_ret_t code, const std::string& what) {
  if (code != RCL_RET_OK) throw RosError(error_text(what, code));
}

}  // namespace connect_bridge::ros
