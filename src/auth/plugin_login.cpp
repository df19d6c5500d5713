#include "auth/plugin_login.hpp"

#include <connect_bridge/auth_plugin.h>
#include <dlfcn.h>
#include <string.h>

#include <array>
#include <utility>

#include "auth/names.hpp"
#include "auth/secret.hpp"
#include "core/base/time.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge {
namespace {

constexpr char kEntry[] = "connect_bridge_auth_plugin";
constexpr std::size_t kSaidBytesMax = 200;

// A text field that the library may not have terminated.
template <std::size_t kSize>
std::string text_in(const char (&field)[kSize]) {
  return {field, ::strnlen(field, kSize)};
}

// The text of dlerror(), which contains the file's name.
std::string loader_says() {
  const char* const error = ::dlerror();
  return error ? error : "it cannot be loaded";
}

const connect_bridge_auth_functions* functions_in(const std::string& file, std::string& problem) {
  problem = plugin_exposure(file);
  if (!problem.empty()) return nullptr;
  void* const library = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    problem = loader_says();
    return nullptr;
  }
  using Entry = const connect_bridge_auth_functions* (*)();
  const auto entry = reinterpret_cast<Entry>(::dlsym(library, kEntry));
  const connect_bridge_auth_functions* const functions = entry ? entry() : nullptr;
  if (!functions) {
    problem = "'" + file + "' has no function " + kEntry + "()";
  } else if (functions->abi != CONNECT_BRIDGE_AUTH_ABI) {
    problem = "'" + file + "' was built for version " + std::to_string(functions->abi) +
              " of the interface; this server has " + std::to_string(CONNECT_BRIDGE_AUTH_ABI);
  } else if (!functions->open || !functions->judge || !functions->close) {
    problem = "'" + file + "' does not set all three functions of the interface";
  } else {
    return functions;
  }
  ::dlclose(library);
  return nullptr;
}

}  // namespace

std::string plugin_exposure(const std::string& file) {
  return exposure_of(file).writable ? "every user of this machine may change '" + file + "'" : "";
}

std::unique_ptr<PluginLogin> PluginLogin::load(const std::string& file, const std::string& options,
                                               std::string& problem) {
  const connect_bridge_auth_functions* const functions = functions_in(file, problem);
  if (!functions) return nullptr;
  std::array<char, 512> said{};
  void* const self = functions->open(options.c_str(), said.data(), said.size());
  if (self) return std::unique_ptr<PluginLogin>(new PluginLogin(*functions, self));
  said.back() = '\0';
  problem = "'" + file + "' does not start: " + to_text(said.data(), said.size());
  return nullptr;
}

PluginLogin::~PluginLogin() {
  functions_.close(self_);
}

Judgement PluginLogin::judge(const Attempt& attempt, Stamp now) {
  if (attempt.method != "plugin")
    return {std::nullopt, "login method '" + attempt.method + "' instead of 'plugin'"};
  const connect_bridge_auth_attempt asked{attempt.credential.data(), attempt.credential.size(),
                                          attempt.peer.c_str(), now};
  const auto answer = std::make_unique<connect_bridge_auth_answer>();  // 9 kB, all zero
  if (functions_.judge(self_, &asked, answer.get()) != 1)
    return {std::nullopt, "plugin: " + to_text(text_in(answer->reason), kSaidBytesMax)};
  Identity identity{text_in(answer->identity), {}, answer->expires};
  std::string wrong = name_problem(identity.name);
  for (const auto& group : answer->groups) {
    if (group[0] == '\0') break;
    identity.groups.push_back(text_in(group));
    if (wrong.empty()) wrong = name_problem(identity.groups.back());
  }
  if (wrong.empty() && identity.expires != 0 && !is_plausible(identity.expires))
    wrong = "has an expiry that is not a time";
  if (!wrong.empty()) return {std::nullopt, "plugin: what it says of the identity " + wrong};
  return {std::move(identity), {}};
}

}  // namespace connect_bridge
