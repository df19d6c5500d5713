// rcl ends a process as it is loaded, before main(), when the RMW is missing that the environment
// names: the very fault that `ctl` is asked about. So `ctl` hides these variables until then.
#include <cstdlib>

#include "ctl/ctl_commands.hpp"
#include "ros/rcl/missing_middleware.hpp"

namespace {

using connect_bridge::ros::kRmwVariables;

constexpr int kHiddenMax = sizeof(kRmwVariables) / sizeof(kRmwVariables[0]);
const char* hidden_values[kHiddenMax];  // their values, where they stood

// The value in "NAME=value"; null: it is another variable.
__attribute__((no_sanitize("address", "undefined", "thread"))) const char* value_behind(
    const char* entry, const char* name) {
  while (*name != '\0' && *entry == *name) ++entry, ++name;
  return *name == '\0' && *entry == '=' ? entry + 1 : nullptr;
}

// Runs before the libraries are initialized: it calls none of them.
__attribute__((no_sanitize("address", "undefined", "thread"))) void hide_variables(
    int, char**, char** environment) {
  char** kept = environment;
  for (char** entry = environment; *entry != nullptr; ++entry) {
    bool is_kept = true;
    for (int i = 0; i < kHiddenMax; ++i) {
      const char* const value = value_behind(*entry, kRmwVariables[i]);
      if (value == nullptr) continue;
      hidden_values[i] = value;
      is_kept = false;
    }
    if (is_kept) *kept++ = *entry;
  }
  *kept = nullptr;
}

__attribute__((section(".preinit_array"),
               used)) void (*const kHideVariables)(int, char**, char**) = hide_variables;

}  // namespace

void show_rmw_variables() {
  for (int i = 0; i < kHiddenMax; ++i)
    if (hidden_values[i] != nullptr) ::setenv(kRmwVariables[i], hidden_values[i], 0);
}
