// Answers of web services that a login method asks: the keys of JSON Web Tokens (JWKS), and an
// external service's judgement. Input: a flag byte, then the answer with its headers.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "access/login/names.hpp"
#include "access/plugins/https.hpp"
#include "access/plugins/key_source.hpp"
#include "access/plugins/service_login.hpp"
#include "fuzz/stand_in.hpp"

using namespace connect_bridge;

namespace {

constexpr Stamp kNow = 1'800'000'000'000'000'000;

// Answers one request with these words, whatever it is.
void answer(const StandIn& service, std::string_view words) {
  const NoAlarm quiet;
  const int client = service.accepted();
  if (client < 0) return;
  char buffer[4096];
  std::string asked;
  for (ssize_t n = 1; n > 0 && asked.find("\r\n\r\n") == std::string::npos;) {
    n = ::recv(client, buffer, sizeof buffer, 0);
    if (n > 0) asked.append(buffer, static_cast<std::size_t>(n));
  }
  ::send(client, words.data(), words.size(), MSG_NOSIGNAL);
  ::shutdown(client, SHUT_WR);
  while (::recv(client, buffer, sizeof buffer, 0) > 0) {
  }
  ::close(client);
}

void check_keys(const Url& address, const HttpFetch& fetch) {
  KeyAddress source(address, fetch);
  std::vector<std::string> problems;
  const auto keys = source.changed(problems);
  CONNECT_CHECK(keys.has_value() == problems.empty());
  for (const std::string& problem : problems) check_loggable(problem);
  if (!keys) return;
  CONNECT_CHECK(!keys->empty() && keys->size() <= kJwtKeysMax);
  for (const JwtKey& key : *keys) CONNECT_CHECK(key.algorithm() != "HS256");
}

void check_judgement(const Url& address, const HttpFetch& fetch, std::string_view words) {
  const std::string_view credential = "a-credential-of-somebody";
  ServiceLogin login(address, fetch);
  Attempt attempt;
  attempt.credential.assign(credential.begin(), credential.end());
  const Judgement judged = login.judge(attempt, kNow);
  CONNECT_CHECK(judged.identity.has_value() == judged.reason.empty());
  check_loggable(judged.reason);
  if (!judged.identity) return;
  CONNECT_CHECK(words.starts_with("HTTP/1.") && words.find("200") != std::string_view::npos);
  CONNECT_CHECK(!judged.identity->name.empty());
  CONNECT_CHECK(judged.identity->groups.size() <= kIdentityGroupsMax);
  CONNECT_CHECK(judged.identity->expires == 0 || judged.identity->expires > kNow);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const StandIn service;
  static Https https("", std::nullopt);
  static const Url address{false, "127.0.0.1", service.port(), "/"};
  if (size == 0) return 0;
  const std::string_view words = words_of(data, size);
  const auto fetch = [](const HttpRequest& request) { return https.fetch(request); };
  std::thread answering([&words] { answer(service, words); });
  if ((data[0] & 1) == 0) {
    check_keys(address, fetch);
  } else {
    check_judgement(address, fetch, words);
  }
  answering.join();
  return 0;
}
