// Login by a method in a shared library: include/connect_bridge/auth_plugin.h.
#pragma once

#include <memory>
#include <string>

#include "auth/authenticator.hpp"

struct connect_bridge_auth_functions;

namespace connect_bridge {

// Why the library must not be loaded; empty: it may. Does not load it.
[[nodiscard]] std::string plugin_exposure(const std::string& file);

class PluginLogin : public Authenticator {
 public:
  // Null with what is wrong in `problem`: the file, its permissions, its interface, or its own
  // error text.
  [[nodiscard]] static std::unique_ptr<PluginLogin> load(const std::string& file,
                                                         const std::string& options,
                                                         std::string& problem);
  ~PluginLogin() override;
  PluginLogin(const PluginLogin&) = delete;
  PluginLogin& operator=(const PluginLogin&) = delete;

  [[nodiscard]] Judgement judge(const Attempt& attempt, Stamp now) override;
  // It may ask others over a network: a slow answer must not delay the next login.
  [[nodiscard]] unsigned threads() const override { return 4; }

 private:
  PluginLogin(const connect_bridge_auth_functions& functions, void* self)
      : functions_(functions), self_(self) {}

  // The library stays loaded: its threads or its exit handlers may outlive us.
  const connect_bridge_auth_functions& functions_;
  void* const self_;
};

}  // namespace connect_bridge
