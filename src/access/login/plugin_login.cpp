#include "access/login/plugin_login.hpp"

#include <connect_bridge/auth_plugin.h>
#include <dlfcn.h>
#include <string.h>

#include <memory>
#include <utility>

#include "access/login/names.hpp"
#include "core/base/time.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge {
namespace {

constexpr char kEntry[] = "connect_bridge_auth_plugin";
constexpr std::size_t kSaidBytesMax = 500;

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
  } else if (functions->abi != CONNECT_BRIDGE_AUTH_ABI) {  // mutant: plugin_version
    problem = "'" + file + "' was built for version " + std::to_string(functions->abi) +
              " of the interface; this server has " + std::to_string(CONNECT_BRIDGE_AUTH_ABI);
  } else if (!functions->method || !functions->open || !functions->judge || !functions->close ||
             functions->threads == 0 || functions->threads > CONNECT_BRIDGE_AUTH_THREADS_MAX) {
    problem = "'" + file + "' does not set what the interface asks for";
  } else {
    return functions;
  }
  ::dlclose(library);
  return nullptr;
}

// Adds the library's reports of a call to `reported`.
connect_bridge_auth_report report_to(Refreshed& reported) {
  const auto say = [](void* server, connect_bridge_auth_level level, const char* text) noexcept {
    Refreshed& to = *static_cast<Refreshed*>(server);
    auto& lines = level == CONNECT_BRIDGE_AUTH_INFO      ? to.news
                  : level == CONNECT_BRIDGE_AUTH_WARNING ? to.warnings
                                                         : to.problems;
    lines.push_back(to_text(text, kSaidBytesMax));
  };
  // A login without a proof has nothing that could be withdrawn.
  const auto withdraw = [](void* server, const char* proof) noexcept {
    if (!*proof) return;  // mutant: plugin_withdraws
    static_cast<Refreshed*>(server)->changes.push_back({proof, std::nullopt});
  };
  return {&reported, say, withdraw};
}

// Fills the identity and returns an empty text, or returns the problem with it.
std::string read_identity(const connect_bridge_auth_answer& answer, Identity& identity) {
  identity = {text_in(answer.identity), {}, answer.expires, text_in(answer.proof)};
  std::string wrong = name_problem(identity.name);
  if (wrong.empty() && !identity.credential.empty()) wrong = name_problem(identity.credential);
  for (const auto& group : answer.groups) {
    if (group[0] == '\0') break;
    identity.groups.push_back(text_in(group));
    if (wrong.empty()) wrong = name_problem(identity.groups.back());
  }
  if (wrong.empty() && identity.expires != 0 && !is_plausible(identity.expires))
    wrong = "has an expiry that is not a time";
  return wrong;
}

}  // namespace

AuthSetup PluginLogin::load(const std::string& file,
                            const std::map<std::string, std::string>& options) {
  AuthSetup setup;
  std::string problem;
  const connect_bridge_auth_functions* const functions = functions_in(file, problem);
  if (!functions) {
    setup.problems.push_back(problem);
    return setup;
  }
  std::vector<connect_bridge_auth_option> given;
  for (const auto& [key, value] : options) given.push_back({key.c_str(), value.c_str()});
  Refreshed reported;
  const connect_bridge_auth_report report = report_to(reported);
  void* const self = functions->open(given.data(), given.size(), &report);
  setup.warnings = std::move(reported.warnings);
  if (self) {
    setup.authenticator.reset(new PluginLogin(*functions, self));
    return setup;
  }
  if (reported.problems.empty()) reported.problems.emplace_back("it does not say why");
  for (const std::string& why : reported.problems)
    setup.problems.push_back("'" + file + "' does not start: " + why);
  return setup;
}

PluginLogin::~PluginLogin() {
  functions_.close(self_);
}

unsigned PluginLogin::threads() const {
  return functions_.threads;
}

Judgement PluginLogin::judge(const Attempt& attempt, Stamp now) {
  const std::string method = functions_.method;
  if (attempt.method != method)
    return {std::nullopt, "login method '" + attempt.method + "' instead of '" + method + "'"};
  const connect_bridge_auth_attempt asked{attempt.credential.data(), attempt.credential.size(),
                                          attempt.peer.c_str(), now};
  const auto answer = std::make_unique<connect_bridge_auth_answer>();  // 66 kB, all zero
  const int verdict = functions_.judge(self_, &asked, answer.get());
  if (verdict != CONNECT_BRIDGE_AUTH_ACCEPTED)  // mutant: plugin_verdict
    return {std::nullopt, method + ": " + to_text(text_in(answer->reason), sizeof answer->reason),
            verdict == CONNECT_BRIDGE_AUTH_REFUSED};  // mutant: plugin_unjudged
  Identity identity;
  const std::string wrong = read_identity(*answer, identity);
  if (!wrong.empty()) return {std::nullopt, method + ": what it says of the identity " + wrong};
  return {std::move(identity), {}};
}

Refreshed PluginLogin::refresh(Stamp now) {
  Refreshed reported;
  const connect_bridge_auth_report report = report_to(reported);
  if (functions_.refresh) functions_.refresh(self_, now, &report);
  return reported;
}

}  // namespace connect_bridge
