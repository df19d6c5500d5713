// A login method in C++ as a library with the C interface of include/connect_bridge/auth_plugin.h.
#pragma once

#include <connect_bridge/auth_plugin.h>

#include <map>
#include <string>

#include "access/login/authenticator.hpp"

namespace connect_bridge {

// Options from the server, by key. A list has blanks between its items.
using PluginOptions = std::map<std::string, std::string>;

// Makes the method that such options request. May throw.
using MakeLogin = AuthSetup (*)(PluginOptions options);

// The functions of the interface, for a method that `make` makes. Exceptions stay inside: a method
// that cannot be made is a problem, and a login without an answer is not judged.
namespace plugin {
[[nodiscard]] void* open(MakeLogin make, const connect_bridge_auth_option* options,
                         std::size_t count, const connect_bridge_auth_report* report) noexcept;
[[nodiscard]] int judge(void* self, const connect_bridge_auth_attempt* attempt,
                        connect_bridge_auth_answer* answer) noexcept;
void refresh(void* self, std::int64_t now, const connect_bridge_auth_report* report) noexcept;
void close(void* self) noexcept;
}  // namespace plugin

// The functions that a library exports. `method`: the name that clients give.
template <MakeLogin kMake>
constexpr connect_bridge_auth_functions plugin_functions(const char* method, unsigned threads) {
  const auto open = [](const connect_bridge_auth_option* options, std::size_t count,
                       const connect_bridge_auth_report* report) noexcept {
    return plugin::open(kMake, options, count, report);
  };
  return {CONNECT_BRIDGE_AUTH_ABI, threads,         method,       open,
          plugin::judge,           plugin::refresh, plugin::close};
}

}  // namespace connect_bridge
