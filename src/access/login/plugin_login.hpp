// Login by a method in a shared library: include/connect_bridge/auth_plugin.h.
#pragma once

#include <map>
#include <string>

#include "access/login/authenticator.hpp"

struct connect_bridge_auth_functions;

namespace connect_bridge {

class PluginLogin : public Authenticator {
 public:
  // Loads the library. Problems are about the file, its permissions or its interface, or come from
  // the library itself.
  [[nodiscard]] static AuthSetup load(const std::string& file,
                                      const std::map<std::string, std::string>& options);
  ~PluginLogin() override;
  PluginLogin(const PluginLogin&) = delete;
  PluginLogin& operator=(const PluginLogin&) = delete;

  [[nodiscard]] Judgement judge(const Attempt& attempt, Stamp now) override;
  [[nodiscard]] Refreshed refresh(Stamp now) override;
  [[nodiscard]] unsigned threads() const override;

 private:
  PluginLogin(const connect_bridge_auth_functions& functions, void* self)
      : functions_(functions), self_(self) {}

  // The library stays loaded: its threads or its exit handlers may outlive us.
  const connect_bridge_auth_functions& functions_;
  void* const self_;
};

}  // namespace connect_bridge
