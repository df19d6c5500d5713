#include "access/plugins/jwt_login.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "access/login/names.hpp"
#include "access/plugins/https.hpp"
#include "config/syntax.hpp"
#include "core/base/base64.hpp"
#include "core/base/json.hpp"

namespace connect_bridge {
namespace {

constexpr Stamp kSkew = 30 * kStampSecond;  // for "nbf" from a clock that is a little ahead

Judgement jwt_refused(std::string why) {
  return {std::nullopt, std::move(why)};
}

struct Parts {
  std::string_view signed_text;
  std::string_view header, payload, signature;
};

std::optional<Parts> split(std::string_view token) {
  const auto first = token.find('.');
  const auto second = token.find('.', first == std::string_view::npos ? first : first + 1);
  if (second == std::string_view::npos || token.find('.', second + 1) != std::string_view::npos)
    return std::nullopt;
  return Parts{token.substr(0, second), token.substr(0, first),
               token.substr(first + 1, second - first - 1), token.substr(second + 1)};
}

Json object_of(std::string_view base64url) {
  const auto text = from_base64url(base64url);
  return text ? Json::parse(text->begin(), text->end(), nullptr, false) : Json();
}

const std::string* text_at(const Json& json, const char* key) {
  const auto member = json.find(key);
  return member == json.end() ? nullptr : member->get_ptr<const std::string*>();
}

// The time in "exp" or "nbf", seconds since 1970. nullopt: no valid number.
std::optional<Stamp> time_of(const Json& json, const char* key) {
  const auto member = json.find(key);
  if (member == json.end() || !member->is_number()) return std::nullopt;
  const double seconds = member->get<double>();
  if (!(seconds >= 0 && seconds <= kExpirySecondsMax)) return std::nullopt;
  return stamp_of_seconds(seconds);
}

bool is_for(const Json& payload, const std::string& audience) {
  const auto member = payload.find("aud");
  if (member == payload.end()) return false;
  if (member->is_string()) return *member == audience;
  return member->is_array() && std::find(member->begin(), member->end(), audience) != member->end();
}

// Adds the groups and returns an empty text, or returns the problem.
std::string read_groups(const Json& payload, const std::string& claim, Identity& identity) {
  const auto member = payload.find(claim);
  if (member == payload.end()) return {};
  const Json list = member->is_string() ? Json::array({*member}) : *member;
  if (!list.is_array() || list.size() > kIdentityGroupsMax)
    return "\"" + claim + "\" is not a list of groups";
  for (const Json& group : list) {
    const auto* name = group.get_ptr<const std::string*>();
    if (!name || !name_problem(*name).empty()) return "a group in \"" + claim + "\" is not a name";
    identity.groups.push_back(*name);
  }
  return {};
}

Judgement judge_claims(const Json& payload, const JwtOptions& options, const std::string& key,
                       Stamp now) {
  if (!payload.is_object()) return jwt_refused("the payload is not a JSON object");
  const std::string* const issuer = text_at(payload, "iss");
  if (!issuer || *issuer != options.issuer)
    return jwt_refused("it is of another issuer");  // mutant: jwt_issuer
  if (!is_for(payload, options.audience))
    return jwt_refused("it is for another audience");  // mutant: jwt_audience
  const auto expires = time_of(payload, "exp");
  if (!expires || *expires == 0) return jwt_refused("\"exp\" is missing or not a time");
  if (*expires <= now) return jwt_refused("it has expired");  // mutant: jwt_expiry
  const auto not_before = time_of(payload, "nbf");
  if (payload.contains("nbf") && !not_before) return jwt_refused("\"nbf\" is not a time");
  if (not_before && *not_before > now + kSkew)
    return jwt_refused("it is not valid yet");  // mutant: jwt_not_before
  const std::string* const subject = text_at(payload, "sub");
  if (!subject || !name_problem(*subject).empty())
    return jwt_refused("\"sub\" is missing or not a name");
  Identity identity{*subject, {}, *expires, key};
  const std::string wrong = read_groups(payload, options.groups_claim, identity);
  if (!wrong.empty()) return jwt_refused(wrong);
  return {std::move(identity), {}};
}

}  // namespace

Judgement judge_jwt(std::string_view token, const std::vector<JwtKey>& keys,
                    const JwtOptions& options, Stamp now, bool* unknown_key) {
  const auto parts = split(token);
  if (!parts) return jwt_refused("it does not have three parts");
  const Json header = object_of(parts->header);
  if (!header.is_object()) return jwt_refused("the header is not a JSON object");
  // "crit" names extensions that must be understood; we understand none.
  if (header.contains("crit")) return jwt_refused("it needs extensions (\"crit\")");
  const std::string* const algorithm = text_at(header, "alg");
  if (!algorithm) return jwt_refused("it names no algorithm");
  const auto signature = from_base64url(parts->signature);
  if (!signature) return jwt_refused("the signature is not base64url");
  const std::string* const id = text_at(header, "kid");
  bool any = false;
  for (const JwtKey& key : keys) {
    if (key.algorithm() != *algorithm) continue;               // mutant: jwt_algorithm
    if (id && !key.id().empty() && key.id() != *id) continue;  // mutant: jwt_key_id
    any = true;
    if (key.verifies(parts->signed_text, *signature))
      return judge_claims(object_of(parts->payload), options, key.fingerprint(), now);
  }
  if (!any && unknown_key) *unknown_key = true;
  return jwt_refused(any ? "the signature is wrong" : "there is no key for it");
}

JwtLogin::JwtLogin(JwtOptions options, std::unique_ptr<KeySource> source)
    : options_(std::move(options)), source_(std::move(source)) {}

Judgement JwtLogin::judge(const Attempt& attempt, Stamp now) {
  const std::string_view token{reinterpret_cast<const char*>(attempt.credential.data()),
                               attempt.credential.size()};
  bool unknown_key = false;
  Judgement judged = judge_jwt(token, keys_, options_, now, &unknown_key);
  if (unknown_key) source_->wanted();
  if (unknown_key && keys_.empty()) judged.judged = false;  // the keys have not arrived yet
  return judged;
}

Refreshed JwtLogin::refresh(Stamp) {
  Refreshed refreshed;
  auto next = source_->changed(refreshed.problems);
  if (!next) return refreshed;
  for (const JwtKey& key : keys_) {
    const auto same = [&](const JwtKey& other) { return other.fingerprint() == key.fingerprint(); };
    if (std::none_of(next->begin(), next->end(), same))  // mutant: jwt_key_gone
      refreshed.changes.push_back({key.fingerprint(), std::nullopt});
  }
  keys_ = std::move(*next);
  refreshed.news.push_back(source_->name() + ": " + std::to_string(keys_.size()) + " keys, " +
                           std::to_string(refreshed.changes.size()) + " withdrawn");
  return refreshed;
}

AuthSetup make_jwt_login(PluginOptions options) {
  AuthSetup setup;
  std::unique_ptr<KeySource> source;
  const auto address = syntax::parse_http_url(options["jwt_keys"]);
  if (address) {
    HttpFetch fetch = https_fetch(*address, options["https_ca"], setup.problems);
    if (!setup.problems.empty()) return setup;
    source = std::make_unique<KeyAddress>(*address, std::move(fetch));
  } else {
    source = std::make_unique<KeyFile>(options["jwt_keys"], options["strict_modes"] != "false");
  }
  auto login = std::make_unique<JwtLogin>(
      JwtOptions{options["jwt_issuer"], options["jwt_audience"], options["jwt_groups_claim"]},
      std::move(source));
  (address ? setup.warnings : setup.problems) = login->refresh(0).problems;
  if (setup.problems.empty()) setup.authenticator = std::move(login);
  return setup;
}

}  // namespace connect_bridge
