// Converts rcl's return codes to text and clears rcl's error state; the only place that does.
#pragma once

#include <rcl/types.h>

#include <string>

namespace connect_bridge::ros {

// The text of rcl's error, without the places in its source. Clears the error text of this thread.
[[nodiscard]] std::string words_of_rcl();

// Makes "what: rcl's own words". Clears the error text of this thread.
[[nodiscard]] std::string error_text(const std::string& what, rcl_ret_t code);

// The reason why an entity cannot be made; `code` as in wire Decline ("type_unknown", "failed").
struct Refusal {
  std::string code;
  std::string reason;          // a sentence that helps a person to act
  std::string hash_here = {};  // hash of the installed type, if a hash is the reason
};
// Makes a Refusal with error_text(). Clears the error text of this thread.
[[nodiscard]] Refusal failure(const std::string& what, rcl_ret_t code);

// Ignores a failure and clears the error text of this thread. True: there was no failure.
bool ignore_error(rcl_ret_t code);

// Throws RosError unless the code is RCL_RET_OK. Only for the start of the program.
void require_ok(rcl_ret_t code, const std::string& what);

}  // namespace connect_bridge::ros
