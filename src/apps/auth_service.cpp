#include "access/plugins/service_login.hpp"

const connect_bridge_auth_functions* connect_bridge_auth_plugin() noexcept {
  // Eight threads: a slow answer must not delay the next login.
  static constexpr auto kFunctions =
      connect_bridge::plugin_functions<&connect_bridge::make_service_login>("service", 8);
  return &kFunctions;
}
