#include "access/plugins/service_login.hpp"

#include <utility>

#include "access/login/names.hpp"
#include "access/login/secret.hpp"
#include "access/plugins/https.hpp"
#include "config/syntax.hpp"
#include "core/base/json.hpp"

namespace connect_bridge {
namespace {

constexpr int kOk = 200;

Judgement service_refused(const std::string& why) {
  return {std::nullopt, why};
}

// The service did not decide about the login.
Judgement unanswered(const std::string& why) {
  Judgement judged = service_refused(why);
  judged.judged = false;  // mutant: service_down
  return judged;
}

// Whether the status means that the login is wrong, or is no login. Other statuses are about the
// service or the path to it.
bool is_refusal(int status) {
  const bool later = status == 408 || status == 425 || status == 429;
  return status >= 400 && status < 500 && status != 404 && !later;
}

// Fills the identity and returns an empty text, or returns the problem with the answer.
std::string read_identity(const Json& answer, Identity& identity) {
  if (!answer.is_object()) return "its answer is not a JSON object";
  const auto name = answer.find("identity");
  if (name == answer.end() || !name->is_string()) return "its answer has no \"identity\"";
  identity.name = name->get<std::string>();
  if (!name_problem(identity.name).empty()) return "its \"identity\" is not a name";
  const auto groups = answer.find("groups");
  if (groups != answer.end() && (!groups->is_array() || groups->size() > kIdentityGroupsMax))
    return "its \"groups\" are not a list";
  for (const Json& group : groups == answer.end() ? Json::array() : *groups) {
    if (!group.is_string() || !name_problem(group.get<std::string>()).empty())
      return "its \"groups\" are not names";
    identity.groups.push_back(group.get<std::string>());
  }
  const auto expires = answer.find("expires");
  if (expires == answer.end()) return {};
  const double seconds = expires->is_number() ? expires->get<double>() : 0;
  if (!(seconds > 0 && seconds <= kExpirySecondsMax)) return "its \"expires\" is not a time";
  identity.expires = stamp_of_seconds(seconds);
  return {};
}

}  // namespace

Judgement ServiceLogin::judge(const Attempt& attempt, Stamp now) {
  const std::string credential{attempt.credential.begin(), attempt.credential.end()};
  if (!token_problem(credential).empty()) return service_refused("the credential is not a token");
  HttpRequest request;
  request.url = service_;
  request.json = Json{{"credential", credential}, {"peer", attempt.peer}}.dump();
  const HttpAnswer answer = fetch_(request);
  wipe(request.json);
  if (!answer.problem.empty()) return unanswered(answer.problem);
  if (is_refusal(answer.status))
    return service_refused("refused (" + std::to_string(answer.status) + ")");
  if (answer.status != kOk) return unanswered("it answers " + std::to_string(answer.status));
  Identity identity;
  const std::string wrong = read_identity(Json::parse(answer.body, nullptr, false), identity);
  if (!wrong.empty()) return unanswered(wrong);
  if (identity.expires != 0 && identity.expires <= now)  // mutant: service_expiry
    return service_refused("it says that the login has expired");
  return {std::move(identity), {}};
}

AuthSetup make_service_login(PluginOptions options) {
  AuthSetup setup;
  const Url service = syntax::parse_http_url(options["service"]).value_or(Url{});
  HttpFetch fetch = https_fetch(service, options["https_ca"], setup.problems);
  if (setup.problems.empty())
    setup.authenticator = std::make_unique<ServiceLogin>(service, std::move(fetch));
  return setup;
}

}  // namespace connect_bridge
