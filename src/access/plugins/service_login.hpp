// Login by an external service, which gets an HTTPS request for each login.
#pragma once

#include "access/login/authenticator.hpp"
#include "access/plugins/http.hpp"
#include "access/plugins/plugin.hpp"

namespace connect_bridge {

// Request: POST of {"credential": TEXT, "peer": "203.0.113.5:51234"}. Answer: 200 with {"identity":
// NAME, "groups": [NAME...], "expires": SECONDS}, the last two optional, seconds since 1970; 401 or
// another 4xx but 404, 408, 425 and 429: refused. All other answers admit nobody either, but count
// as no judgement.
class ServiceLogin : public Authenticator {
 public:
  ServiceLogin(Url service, HttpFetch fetch)
      : service_(std::move(service)), fetch_(std::move(fetch)) {}

  [[nodiscard]] Judgement judge(const Attempt& attempt, Stamp now) override;

 private:
  const Url service_;
  const HttpFetch fetch_;
};

// Makes the login from the options service and https_ca.
[[nodiscard]] AuthSetup make_service_login(PluginOptions options);

}  // namespace connect_bridge
