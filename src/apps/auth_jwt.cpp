#include "access/plugins/jwt_login.hpp"

const connect_bridge_auth_functions* connect_bridge_auth_plugin() noexcept {
  static constexpr auto kFunctions =
      connect_bridge::plugin_functions<&connect_bridge::make_jwt_login>("jwt", 1);
  return &kFunctions;
}
