#include "ros/rcl/rcl_result.hpp"

#include <rcl/error_handling.h>

#include <regex>

#include "ros/rcl/ros_error.hpp"

namespace connect_bridge::ros {

std::string words_of_rcl() {
  static const std::regex place(R"(\s*, at \S+\.[ch](pp)?:[0-9]+)");
  const std::string words = rcl_get_error_string().str;
  rcl_reset_error();
  return std::regex_replace(words, place, "");
}

std::string error_text(const std::string& what, rcl_ret_t code) {
  std::string text = what + ": ";
  if (rcl_error_is_set()) {
    text += words_of_rcl();
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
