#include "access/plugins/plugin.hpp"

#include <openssl/crypto.h>

#include <algorithm>
#include <exception>
#include <utility>

namespace connect_bridge::plugin {
namespace {

// Writes a text, and cuts it if it is too long. The rest of the field is zero already.
template <std::size_t kSize>
void write(char (&field)[kSize], const std::string& text) {
  std::copy_n(text.data(), std::min(text.size(), kSize - 1), field);
}

void say(const connect_bridge_auth_report& report, connect_bridge_auth_level level,
         const std::vector<std::string>& lines) {
  for (const std::string& line : lines) report.say(report.server, level, line.c_str());
}

void fail(const connect_bridge_auth_report& report, const std::exception& error) {
  report.say(report.server, CONNECT_BRIDGE_AUTH_ERROR, error.what());
}

int write(const Judgement& judged, connect_bridge_auth_answer& answer) {
  write(answer.reason, judged.reason);
  if (!judged.judged) return CONNECT_BRIDGE_AUTH_UNJUDGED;
  if (!judged.identity) return CONNECT_BRIDGE_AUTH_REFUSED;
  const Identity& who = *judged.identity;
  write(answer.identity, who.name);
  write(answer.proof, who.credential);
  answer.expires = who.expires;
  for (std::size_t i = 0; i < who.groups.size(); ++i) write(answer.groups[i], who.groups[i]);
  return CONNECT_BRIDGE_AUTH_ACCEPTED;
}

}  // namespace

void* open(MakeLogin make, const connect_bridge_auth_option* options, std::size_t count,
           const connect_bridge_auth_report* report) noexcept try {
  PluginOptions given;
  for (std::size_t i = 0; i < count; ++i) given.emplace(options[i].key, options[i].value);
  AuthSetup setup = make(std::move(given));
  say(*report, CONNECT_BRIDGE_AUTH_WARNING, setup.warnings);
  say(*report, CONNECT_BRIDGE_AUTH_ERROR, setup.problems);
  return setup.authenticator.release();
} catch (const std::exception& error) {
  fail(*report, error);
  return nullptr;
}

int judge(void* self, const connect_bridge_auth_attempt* attempt,
          connect_bridge_auth_answer* answer) noexcept try {
  const std::uint8_t* const shown = attempt->credential;
  Attempt asked{"", {shown, shown + attempt->credential_size}, attempt->peer};
  const Judgement judged = static_cast<Authenticator*>(self)->judge(asked, attempt->now);
  OPENSSL_cleanse(asked.credential.data(), asked.credential.size());
  return write(judged, *answer);
} catch (const std::exception& error) {
  write(answer->reason, error.what());
  return CONNECT_BRIDGE_AUTH_UNJUDGED;
}

void refresh(void* self, std::int64_t now, const connect_bridge_auth_report* report) noexcept try {
  const Refreshed refreshed = static_cast<Authenticator*>(self)->refresh(now);
  say(*report, CONNECT_BRIDGE_AUTH_INFO, refreshed.news);
  say(*report, CONNECT_BRIDGE_AUTH_WARNING, refreshed.warnings);
  say(*report, CONNECT_BRIDGE_AUTH_ERROR, refreshed.problems);
  for (const auto& change : refreshed.changes)
    report->withdraw(report->server, change.credential.c_str());
} catch (const std::exception& error) {
  fail(*report, error);
}

void close(void* self) noexcept {
  delete static_cast<Authenticator*>(self);
}

}  // namespace connect_bridge::plugin
