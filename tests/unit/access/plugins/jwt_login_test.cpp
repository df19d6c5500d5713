#include "access/plugins/jwt_login.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "core/base/base64.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr Stamp kJwtNow = 1'800'000'000 * kStampSecond;

// The octet key of RFC 7515 A.1, the public keys of A.2, A.3 and of RFC 8037 A.2.
constexpr char kOct[] =
    R"({"kty":"oct","kid":"h","k":"AyM1SysPpbyDfgZld3umj1qzKObwVMkoqQ-EstJQLr_T-1qS0gZH)"
    R"(75aKtMN3Yj0iPS4hcgUuTwjAzZr1Z9CAow"})";
constexpr char kRsa[] =
    R"({"kty":"RSA","kid":"r","n":"ofgWCuLjybRlzo0tZWJjNiuSfb4p4fAkd_wWJcyQoTbji9k0l8W2)"
    R"(6mPddxHmfHQp-Vaw-4qPCJrcS2mJPMEzP1Pt0Bm4d4QlL-yRT-SFd2lZS-pCgNMsD1W_YpRPEwOWvG6b)"
    R"(32690r2jZ47soMZo9wGzjb_7OMg0LOL-bSf63kpaSHSXndS5z5rexMdbBYUsLA9e-KXBdQOS-UTo7WTB)"
    R"(EMa2R2CapHg665xsmtdVMTBQY4uDZlxvb3qCo5ZwKh9kG4LT6_I5IhlJH7aGhyxXFvUK-DWNmoudF8NA)"
    R"(co9_h9iaGNj8q2ethFkMLs91kzk2PAcDTW9gb54h4FRWyuXpoQ","e":"AQAB"})";
constexpr char kEc[] =
    R"({"kty":"EC","crv":"P-256","kid":"e","x":"f83OJ3D2xF1Bg8vub9tLe1gHMzV76e8Tus9uPHv)"
    R"(RVEU","y":"x_FEzRu9m36HLN_tue659LNpXW6pCyStikYjKIWI5a0"})";
constexpr char kEd[] =
    R"({"kty":"OKP","crv":"Ed25519","kid":"d","x":"11qYAYKxCrfVS_7TyWQHOg7hcvPapiMlrwIa)"
    R"(aPcHURo"})";

std::string jwks(const std::vector<std::string>& keys) {
  std::string text = R"({"keys":[)";
  for (const auto& key : keys) text += (text.back() == '[' ? "" : ",") + key;
  return text + "]}";
}

std::vector<JwtKey> keys_of(const std::string& text) {
  std::vector<std::string> problems;
  auto keys = read_jwt_keys(text, "keys", problems);
  EXPECT_THAT(problems, IsEmpty());
  return keys;
}

std::vector<std::string> problems_of(const std::string& text) {
  std::vector<std::string> problems;
  static_cast<void>(read_jwt_keys(text, "keys", problems));
  return problems;
}

// Signed by the octet key.
std::string token(const std::string& payload,
                  const std::string& header = R"({"alg":"HS256","typ":"JWT"})") {
  const std::string text = to_base64url(view_of(header)) + "." + to_base64url(view_of(payload));
  const Bytes secret =
      *from_base64url(std::string_view(kOct).substr(std::string_view(kOct).find("Ay"), 86));
  Bytes code(32);
  unsigned size = 0;
  HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()), view_of(text).data(),
       text.size(), code.data(), &size);
  return text + "." + to_base64url(code);
}

JwtOptions options() {
  return {"https://id.example", "robot", "groups"};
}

std::string claims(const std::string& more = {}) {
  return R"({"iss":"https://id.example","aud":"robot","sub":"anna","exp":1800000060)" +
         (more.empty() ? "" : "," + more) + "}";
}

std::string refusal_of(const std::string& text, const JwtOptions& how = options()) {
  const Judgement judged = judge_jwt(text, keys_of(jwks({kOct, kRsa, kEc, kEd})), how, kJwtNow);
  EXPECT_EQ(judged.identity.has_value(), judged.reason.empty());
  return judged.reason;
}

bool verifies(const char* key, const std::string& text, const std::string& signature) {
  return keys_of(jwks({key})).at(0).verifies(text, *from_base64url(signature));
}

// ---- signatures

constexpr char kJoe[] =
    ".eyJpc3MiOiJqb2UiLA0KICJleHAiOjEzMDA4MTkzODAsDQogImh0dHA6Ly9leGFtcGxlLmNvbS9pc19yb290Ijp0cnVlf"
    "Q";

struct Vector {
  const char* key;
  std::string text, signature;
};

std::vector<Vector> vectors() {
  return {
      {kOct, std::string("eyJ0eXAiOiJKV1QiLA0KICJhbGciOiJIUzI1NiJ9") + kJoe,
       "dBjftJeZ4CVP-mB92K27uhbUJU1p1r_wW1gFWFOEjXk"},
      {kRsa, std::string("eyJhbGciOiJSUzI1NiJ9") + kJoe,
       "cC4hiUPoj9Eetdgtv3hF80EGrhuB__dzERat0XF9g2VtQgr9PJbu3XOiZj5RZmh7AAuHIm4Bh-0Qc_lF5YKt_"
       "O8W2Fp5jujGbds9uJdbF9CUAr7t1dnZcAcQjbKBYNX4BAynRFdiuB--f_nZLgrnbyTyWzO75vRK5h6xBArLIA"
       "RNPvkSjtQBMHlb1L07Qe7K0GarZRmB_eSN9383LcOLn6_dO--xi12jzDwusC-eOkHWEsqtFZESc6BfI7noOPqv"
       "hJ1phCnvWh6IeYI2w9QOYEUipUTI8np6LbgGY9Fs98rqVt5AXLIhWkWywlVmtVrBp0igcN_IoypGlUPQGe77Rw"},
      {kEc, std::string("eyJhbGciOiJFUzI1NiJ9") + kJoe,
       "DtEhU3ljbEg8L38VWAfUAqOyKAM6-Xx-F4GawxaepmXFCgfTjDxw5djxLa8ISlSApmWQxfKTUJqPP3-Kg6NU1Q"},
      {kEd, "eyJhbGciOiJFZERTQSJ9.RXhhbXBsZSBvZiBFZDI1NTE5IHNpZ25pbmc",
       "hgyY0il_MGCjP0JzlnLWG1PPOt7-09PGcvMg3AIbQR6dWbhijcNR4ki4iylGjg5BhVsPt9g7sVvpAr_MuM0KAg"}};
}

TEST(JwtKey, VerifiesTheVectorsOfTheStandardsAndNothingElse) {
  for (const Vector& v : vectors()) {
    EXPECT_TRUE(verifies(v.key, v.text, v.signature)) << v.key;
    EXPECT_FALSE(verifies(v.key, v.text + "x", v.signature)) << v.key;
    EXPECT_FALSE(verifies(v.key, v.text, "")) << v.key;
    EXPECT_FALSE(verifies(v.key, v.text, v.signature.substr(4))) << v.key;
    std::string other = v.signature;
    other[10] = other[10] == 'A' ? 'B' : 'A';
    EXPECT_FALSE(verifies(v.key, v.text, other)) << v.key;
    for (const Vector& another : vectors()) {
      if (another.key == v.key) continue;
      EXPECT_FALSE(verifies(another.key, v.text, v.signature));
    }
  }
  EXPECT_FALSE(verifies(kEc, vectors()[2].text, std::string(86, 'A')));  // r and s are zero
}

// ---- keys

TEST(JwtKey, IsReadFromAJwks) {
  const auto keys = keys_of(jwks({kOct, kRsa, kEc, kEd}));
  std::vector<std::string> algorithms;
  for (const auto& key : keys) algorithms.push_back(key.algorithm() + " " + key.id());
  EXPECT_THAT(algorithms, ElementsAre("HS256 h", "RS256 r", "ES256 e", "EdDSA d"));
  // Keys of another use, curve, algorithm or type are skipped.
  EXPECT_EQ(
      keys_of(jwks({kEd, R"({"kty":"RSA","use":"enc","n":"AQAB","e":"AQAB"})",
                    R"({"kty":"EC","crv":"P-521","x":"AA","y":"AA"})",
                    R"({"kty":"RSA","alg":"RSA-OAEP","n":"AQAB","e":"AQAB"})", R"({"kty":"AKP"})"}))
          .size(),
      1U);
}

TEST(JwtKey, IsReadFromPem) {
  EVP_PKEY* const made = EVP_PKEY_Q_keygen(nullptr, nullptr, "EC", "P-256");
  BIO* const memory = BIO_new(BIO_s_mem());
  PEM_write_bio_PUBKEY(memory, made);
  PEM_write_bio_PUBKEY(memory, made);
  char* data = nullptr;
  const auto size = static_cast<std::size_t>(BIO_get_mem_data(memory, &data));
  const auto keys = keys_of("# two of them\n" + std::string(data, size));
  ASSERT_EQ(keys.size(), 2U);
  EXPECT_EQ(keys[0].algorithm(), "ES256");
  EXPECT_EQ(keys[0].fingerprint(), keys[1].fingerprint());
  BIO* const secret = BIO_new(BIO_s_mem());
  PEM_write_bio_PrivateKey(secret, made, nullptr, nullptr, 0, nullptr, nullptr);
  const auto secret_size = static_cast<std::size_t>(BIO_get_mem_data(secret, &data));
  EXPECT_THAT(problems_of({data, secret_size}), ElementsAre(HasSubstr("private key")));
  BIO_free_all(memory);
  BIO_free_all(secret);
  EVP_PKEY_free(made);
}

TEST(JwtKey, IsRefusedWhenItIsWeakOrPrivateOrNone) {
  const auto said = [](const std::string& key) { return problems_of(jwks({key})).at(0); };
  EXPECT_THAT(said(R"({"kty":"oct","k":"c2hvcnQ"})"), HasSubstr("less than 32 bytes"));
  EXPECT_THAT(said(R"({"kty":"RSA","n":"AQAB","e":"AQAB"})"), HasSubstr("2048"));
  EXPECT_THAT(said(R"({"kty":"EC","crv":"P-256","x":"AA","y":"AA"})"), HasSubstr("is not a key"));
  EXPECT_THAT(said(R"({"kty":"OKP","crv":"Ed25519","x":"AA"})"), HasSubstr("is not a key"));
  EXPECT_THAT(said(std::string(kEd).replace(1, 0, R"("d":"AA",)")), HasSubstr("private"));
  EXPECT_THAT(said(std::string(kEd).replace(1, 0, R"("alg":"HS256",)")), HasSubstr("another type"));
  EXPECT_THAT(said(std::string(kOct).replace(1, 0, R"("alg":"RS256",)")),
              HasSubstr("another type"));
  EXPECT_THAT(said("7"), HasSubstr("is not an object"));
  for (const std::string none : {"", "{", "{}", R"({"keys":7})", R"({"keys":[]})", "word",
                                 "-----BEGIN PUBLIC KEY-----\nAAAA\n-----END PUBLIC KEY-----\n"})
    EXPECT_EQ(problems_of(none).size(), 1U) << none;
  EXPECT_THAT(problems_of(jwks(std::vector<std::string>(65, kEd))),
              ElementsAre(HasSubstr("more than 64")));
}

// All bits of these moduli are set, which makes no good key, but one of that size.
TEST(JwtKey, IsTakenFromItsLeastSizeOn) {
  const auto rsa = [](std::size_t characters, const std::string& last) {
    return jwks({R"({"kty":"RSA","e":"AQAB","n":")" + std::string(characters, '_') + last + "\"}"});
  };
  EXPECT_EQ(keys_of(rsa(341, "w")).size(), 1U);  // 256 bytes
  EXPECT_THAT(problems_of(rsa(340, "")), ElementsAre(HasSubstr("less than 2048 bits")));
  const std::string bytes32 = R"({"kty":"oct","k":")" + std::string(43, 'A') + "\"}";
  EXPECT_EQ(keys_of(jwks({bytes32})).size(), 1U);
  const std::string bytes31 = std::string(bytes32).erase(bytes32.find('A'), 1);
  EXPECT_THAT(problems_of(jwks({bytes31})), ElementsAre(HasSubstr("less than 32 bytes")));
}

// ---- tokens

TEST(Jwt, SaysWhoItIs) {
  const auto keys = keys_of(jwks({kOct}));
  const Judgement anna = judge_jwt(token(claims(R"("groups":["ops","night"],"nbf":1800000020)")),
                                   keys, options(), kJwtNow);
  ASSERT_TRUE(anna.identity.has_value()) << anna.reason;
  EXPECT_EQ(anna.identity->name, "anna");
  EXPECT_THAT(anna.identity->groups, ElementsAre("ops", "night"));
  EXPECT_EQ(anna.identity->expires, 1'800'000'060 * kStampSecond);
  EXPECT_EQ(anna.identity->credential, keys[0].fingerprint());
  EXPECT_EQ(refusal_of(token(claims(R"("groups":"ops")"))), "");
  EXPECT_EQ(refusal_of(token(claims(), R"({"alg":"HS256","kid":"h"})")), "");
  std::string several = claims();
  several.replace(several.find(R"("robot")"), 7, R"(["other","robot"])");
  EXPECT_EQ(refusal_of(token(several)), "");
}

TEST(Jwt, IsRefusedForWhatItClaims) {
  const auto with = [](const std::string& what, const std::string& instead) {
    std::string text = claims();
    text.replace(text.find(what), what.size(), instead);
    return refusal_of(token(text));
  };
  EXPECT_THAT(with("id.example", "id.evil"), HasSubstr("another issuer"));
  EXPECT_THAT(with(R"("iss")", R"("iso")"), HasSubstr("another issuer"));
  EXPECT_THAT(with(R"("robot")", R"("robots")"), HasSubstr("another audience"));
  EXPECT_THAT(with(R"("robot")", R"(["a",7])"), HasSubstr("another audience"));
  EXPECT_THAT(with(R"("aud")", R"("add")"), HasSubstr("another audience"));
  EXPECT_THAT(with("1800000060", "1800000000"), HasSubstr("has expired"));
  for (const char* time : {"0", "-1", "1e300", "\"1800000060\"", "null", "18000000600000"})
    EXPECT_THAT(with("1800000060", time), HasSubstr("missing or not a time")) << time;
  EXPECT_THAT(with(R"("exp")", R"("ex")"), HasSubstr("missing or not a time"));
  EXPECT_THAT(with(R"("anna")", R"("")"), HasSubstr("not a name"));
  EXPECT_THAT(with(R"("anna")", R"("a\n")"), HasSubstr("not a name"));
  EXPECT_THAT(with(R"("anna")", "7"), HasSubstr("not a name"));
  EXPECT_THAT(refusal_of(token(claims(R"("nbf":1800000031)"))), HasSubstr("not valid yet"));
  EXPECT_THAT(refusal_of(token(claims(R"("nbf":"soon")"))), HasSubstr("not a time"));
  EXPECT_THAT(refusal_of(token(claims(R"("groups":{"a":1})"))), HasSubstr("list of groups"));
  EXPECT_THAT(refusal_of(token(claims(R"("groups":[""])"))), HasSubstr("not a name"));
  std::string many = R"("groups":["ops")";
  for (int i = 2; i <= 256; ++i) many += R"(,"ops")";
  EXPECT_EQ(refusal_of(token(claims(many + "]"))), "");
  EXPECT_THAT(refusal_of(token(claims(many + R"(,"ops"])"))), HasSubstr("list of groups"));
  EXPECT_THAT(refusal_of(token("[]")), HasSubstr("not a JSON object"));
  EXPECT_THAT(refusal_of(token("{")), HasSubstr("not a JSON object"));
}

TEST(Jwt, IsRefusedForItsAlgorithm) {
  const std::string body = to_base64url(view_of(claims()));
  for (const char* header : {R"({"alg":"none"})", R"({"alg":"None"})", R"({"alg":""})", "{}",
                             R"({"alg":null})", R"({"alg":["HS256"]})", R"({"alg":"HS512"})"}) {
    for (const char* signature : {"", "AAAA"})
      EXPECT_THAT(refusal_of(to_base64url(view_of(header)) + "." + body + "." + signature),
                  AnyOf(HasSubstr("no key for it"), HasSubstr("no algorithm")))
          << header;
  }
  EXPECT_THAT(refusal_of(token(claims(), R"({"alg":"HS256","crit":["b64"]})")),
              HasSubstr("extensions"));
  EXPECT_THAT(refusal_of(token(claims(), R"({"alg":"HS256","kid":"r"})")),
              HasSubstr("no key for it"));
  EXPECT_THAT(refusal_of(token(claims(), R"({"alg":"EdDSA","kid":"d"})")),
              HasSubstr("signature is wrong"));
}

// The classic attack: a public key, which everybody has, used as the secret of HS256.
TEST(Jwt, APublicKeyIsNoSecret) {
  const auto keys = keys_of(jwks({kRsa, kEc, kEd}));
  const std::string forged = token(claims());
  EXPECT_THAT(judge_jwt(forged, keys, options(), kJwtNow).reason, HasSubstr("no key for it"));
}

TEST(Jwt, IsRefusedForItsForm) {
  const std::string right = token(claims());
  for (const std::string& wrong :
       {std::string{}, std::string("."), std::string(".."), std::string("..."), right + ".",
        "." + right, right + "=", right.substr(0, right.size() - 1), right + "A",
        right.substr(0, right.rfind('.') + 1), std::string(3900, '.'), std::string(3900, 'A')})
    EXPECT_NE(refusal_of(wrong), "") << wrong;
}

// ---- the file

// Has the octet key, or none yet, and counts how often others are wanted.
class OneKey : public KeySource {
 public:
  explicit OneKey(int& wanted, bool there = true) : wanted_(wanted), there_(there) {}
  [[nodiscard]] std::string name() const override { return "one"; }
  [[nodiscard]] std::optional<std::vector<JwtKey>> changed(std::vector<std::string>&) override {
    return there_ ? std::optional(keys_of(jwks({kOct}))) : std::nullopt;
  }
  void wanted() override { ++wanted_; }

 private:
  int& wanted_;
  const bool there_;
};

TEST(JwtLogin, WithoutAnyKeysYetNobodyIsWrong) {
  int wanted = 0;
  JwtLogin login({}, std::make_unique<OneKey>(wanted, false));
  const auto judged = [&](const std::string& token) {
    return login.judge({"", Bytes(token.begin(), token.end()), ""}, kJwtNow);
  };
  const Judgement first = judged("eyJhbGciOiJIUzI1NiJ9.e30.AAAA");
  EXPECT_THAT(first.reason, HasSubstr("no key for it"));
  EXPECT_FALSE(first.judged);
  EXPECT_TRUE(judged("no token").judged);
  EXPECT_EQ(wanted, 1);
}

// Everybody can show a token with a wrong signature: it must not cause a request.
TEST(JwtLogin, WantsOtherKeysForAnUnknownOneAlone) {
  int wanted = 0;
  JwtLogin login(options(), std::make_unique<OneKey>(wanted));
  ASSERT_THAT(login.refresh(kJwtNow).problems, IsEmpty());
  const auto judged = [&](const std::string& text) {
    return login.judge({"", Bytes(text.begin(), text.end()), ""}, kJwtNow);
  };
  const std::string right = token(claims());
  EXPECT_TRUE(judged(right).identity.has_value());
  EXPECT_THAT(judged(right.substr(0, right.rfind('.')) + ".AAAA").reason,
              HasSubstr("signature is wrong"));
  EXPECT_EQ(wanted, 0);
  const Judgement unknown = judged(token(claims(), R"({"alg":"HS256","kid":"next"})"));
  EXPECT_THAT(unknown.reason, HasSubstr("no key for it"));
  EXPECT_TRUE(unknown.judged);
  EXPECT_EQ(wanted, 1);
}

TEST(JwtLogin, FollowsItsKeysWholeOrNotAtAll) {
  const std::string file = test::scratch_folder() + "keys.json";
  const auto write = [&](const std::string& text) {
    std::ofstream{file} << text;
    ::chmod(file.c_str(), 0600);
  };
  write(jwks({kOct, kEd}));
  const AuthSetup setup = make_jwt_login({{"jwt_keys", file},
                                          {"jwt_issuer", "https://id.example"},
                                          {"jwt_audience", "robot"},
                                          {"jwt_groups_claim", "groups"}});
  ASSERT_THAT(setup.problems, IsEmpty());
  const auto judge = [&] {
    const std::string text = token(claims());
    return setup.authenticator->judge({"", Bytes(text.begin(), text.end()), "1.1.1.1:1"}, kJwtNow);
  };
  const auto look = [&] {
    EXPECT_THAT(setup.authenticator->refresh(kJwtNow).problems, IsEmpty());
    return setup.authenticator->refresh(kJwtNow);
  };
  const Judgement anna = judge();
  ASSERT_TRUE(anna.identity.has_value());
  write("{");
  EXPECT_THAT(look().problems, ElementsAre(HasSubstr("expected {\"keys\"")));
  EXPECT_TRUE(judge().identity.has_value());
  write(jwks({kEd}));  // the key of Anna's token is withdrawn
  const Refreshed withdrawn = look();
  ASSERT_EQ(withdrawn.changes.size(), 1U);
  EXPECT_EQ(withdrawn.changes[0].credential, anna.identity->credential);
  EXPECT_FALSE(judge().identity.has_value());
  write(jwks({kOct, kEd, kEc}));
  EXPECT_THAT(look().changes, IsEmpty());
  EXPECT_TRUE(judge().identity.has_value());
}

}  // namespace
}  // namespace connect_bridge
