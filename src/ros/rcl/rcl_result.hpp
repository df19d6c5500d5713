// The one place where rcl's return codes become text and rcl's error state is cleared.
#pragma once

#include <rcl/types.h>

#include <string>

namespace connect_bridge::ros {

// What rcl says of its error, without the places in its source. Clears the error text of this
// thread.
[[nodiscard]] std::string words_of_rcl();

// "what: rcl's own words". Clears the error text of this thread.
[[nodiscard]] std::string error_text(const std::string& what, rcl_ret_t code);

// Why an entity cannot be made; `code` as in wire Decline ("type_unknown", "failed").
struct Refusal {
  std::string code;
  std::string reason;          // a sentence a person can act on
  std::string hash_here = {};  // of the installed type, if that is why
};
// An error_text() as refusal. Clears the error text of this thread.
[[nodiscard]] Refusal failure(const std::string& what, rcl_ret_t code);

// Ignores a failure; clears the error text of this thread. True: there was none.
bool ignore_error(rcl_ret_t code);

// Start-up only: throws RosError unless the code is RCL_RET_OK.
void require_ok(rcl_ret_t code, const std::string& what);

}  // namespace connect_bridge::ros
