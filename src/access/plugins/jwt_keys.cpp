#include "access/plugins/jwt_keys.hpp"

#include <openssl/bn.h>
#include <openssl/core_names.h>
#include <openssl/crypto.h>
#include <openssl/ecdsa.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/param_build.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <algorithm>
#include <array>
#include <utility>

#include "access/login/secret.hpp"
#include "core/base/base64.hpp"
#include "core/base/hex.hpp"
#include "core/base/json.hpp"

namespace connect_bridge {
namespace {

using Key = std::shared_ptr<EVP_PKEY>;

constexpr int kRsaBitsMin = 2048;
constexpr std::size_t kSecretBytesMin = 32;  // RFC 7518 section 3.2
constexpr std::size_t kP256Bytes = 32;

template <class T, void (*kFree)(T*)>
struct Free {
  void operator()(T* object) const { kFree(object); }
};
template <class T, void (*kFree)(T*)>
using Owned = std::unique_ptr<T, Free<T, kFree>>;

Key owned(EVP_PKEY* key) {
  return {key, &EVP_PKEY_free};
}

// The algorithm of a key; empty: its type is not supported, or it is too weak.
std::string algorithm_of(const EVP_PKEY* key) {
  std::array<char, 64> group{};
  switch (EVP_PKEY_get_base_id(key)) {
    case EVP_PKEY_RSA: return EVP_PKEY_get_bits(key) >= kRsaBitsMin ? "RS256" : "";
    case EVP_PKEY_ED25519: return "EdDSA";
    case EVP_PKEY_EC:
      return EVP_PKEY_get_group_name(key, group.data(), group.size(), nullptr) == 1 &&
                     std::string_view{group.data()} == SN_X9_62_prime256v1
                 ? "ES256"
                 : "";
    default: return "";
  }
}

Key made_of(const char* type, OSSL_PARAM_BLD* parts) {
  const Owned<OSSL_PARAM, OSSL_PARAM_free> parameters(OSSL_PARAM_BLD_to_param(parts));
  const Owned<EVP_PKEY_CTX, EVP_PKEY_CTX_free> context(
      EVP_PKEY_CTX_new_from_name(nullptr, type, nullptr));
  EVP_PKEY* key = nullptr;
  if (!parameters || !context || EVP_PKEY_fromdata_init(context.get()) != 1 ||
      EVP_PKEY_fromdata(context.get(), &key, EVP_PKEY_PUBLIC_KEY, parameters.get()) != 1)
    return nullptr;
  return owned(key);
}

Key rsa_key(const Bytes& n, const Bytes& e) {
  const Owned<OSSL_PARAM_BLD, OSSL_PARAM_BLD_free> parts(OSSL_PARAM_BLD_new());
  const Owned<BIGNUM, BN_free> modulus(BN_bin2bn(n.data(), static_cast<int>(n.size()), nullptr));
  const Owned<BIGNUM, BN_free> exponent(BN_bin2bn(e.data(), static_cast<int>(e.size()), nullptr));
  if (!parts || !OSSL_PARAM_BLD_push_BN(parts.get(), OSSL_PKEY_PARAM_RSA_N, modulus.get()) ||
      !OSSL_PARAM_BLD_push_BN(parts.get(), OSSL_PKEY_PARAM_RSA_E, exponent.get()))
    return nullptr;
  return made_of("RSA", parts.get());
}

Key ec_key(const Bytes& x, const Bytes& y) {
  if (x.size() != kP256Bytes || y.size() != kP256Bytes) return nullptr;
  Bytes point{POINT_CONVERSION_UNCOMPRESSED};
  point.insert(point.end(), x.begin(), x.end());
  point.insert(point.end(), y.begin(), y.end());
  const Owned<OSSL_PARAM_BLD, OSSL_PARAM_BLD_free> parts(OSSL_PARAM_BLD_new());
  if (!parts ||
      !OSSL_PARAM_BLD_push_utf8_string(parts.get(), OSSL_PKEY_PARAM_GROUP_NAME, "P-256", 0) ||
      !OSSL_PARAM_BLD_push_octet_string(parts.get(), OSSL_PKEY_PARAM_PUB_KEY, point.data(),
                                        point.size()))
    return nullptr;
  return made_of("EC", parts.get());
}

// ---- one key of a JWKS

std::string text_of(const Json& json, const char* key) {
  const auto member = json.find(key);
  return member != json.end() && member->is_string() ? member->get<std::string>() : std::string{};
}

Bytes bytes_of(const Json& json, const char* key) {
  return from_base64url(text_of(json, key)).value_or(Bytes{});
}

Key public_key(const Json& json) {
  const std::string type = text_of(json, "kty");
  if (type == "RSA") return rsa_key(bytes_of(json, "n"), bytes_of(json, "e"));
  if (type == "EC" && text_of(json, "crv") == "P-256")
    return ec_key(bytes_of(json, "x"), bytes_of(json, "y"));
  if (type != "OKP" || text_of(json, "crv") != "Ed25519") return nullptr;
  const Bytes x = bytes_of(json, "x");
  return owned(EVP_PKEY_new_raw_public_key(EVP_PKEY_ED25519, nullptr, x.data(), x.size()));
}

// Whether the key is for another use or algorithm, so that it is skipped.
bool is_foreign(const Json& json) {
  constexpr std::array kTypes{"RSA", "EC", "OKP", "oct"};
  constexpr std::array kAlgorithms{"RS256", "ES256", "EdDSA", "HS256"};
  const auto in = [](const std::string& word, const auto& words) {
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  const std::string algorithm = text_of(json, "alg");
  const std::string use = text_of(json, "use");
  const std::string curve = text_of(json, "crv");
  return !in(text_of(json, "kty"), kTypes) || (!use.empty() && use != "sig") ||
         (!algorithm.empty() && !in(algorithm, kAlgorithms)) ||
         (!curve.empty() && curve != "P-256" && curve != "Ed25519");
}

// Adds the key and returns an empty text, or returns the problem.
std::string add_json_key(const Json& json, std::vector<JwtKey>& keys) {
  if (!json.is_object()) return "is not an object";
  if (is_foreign(json)) return {};
  const std::string id = text_of(json, "kid");
  const std::string algorithm = text_of(json, "alg");
  if (text_of(json, "kty") == "oct") {
    Bytes secret = bytes_of(json, "k");
    if (secret.size() < kSecretBytesMin) return "is a secret of less than 32 bytes";
    if (!algorithm.empty() && algorithm != "HS256") return "has an \"alg\" of another type";
    keys.emplace_back(id, std::move(secret));
    return {};
  }
  if (json.contains("d")) return "is a private key; a server needs the public one only";
  const Key key = public_key(json);
  const std::string own = key ? algorithm_of(key.get()) : std::string{};
  if (own.empty()) return "is not a key, or is an RSA key of less than 2048 bits";
  if (!algorithm.empty() && algorithm != own) return "has an \"alg\" of another type";
  keys.emplace_back(own, id, key);
  return {};
}

void read_jwks(std::string_view text, const std::string& source, std::vector<JwtKey>& keys,
               std::vector<std::string>& problems) {
  const Json json = Json::parse(text, nullptr, false);
  const auto list = json.is_object() ? json.find("keys") : json.end();
  if (!json.is_object() || list == json.end() || !list->is_array()) {
    problems.push_back(source + ": expected {\"keys\": [...]}, or public keys in PEM");
    return;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string wrong = add_json_key((*list)[i], keys);
    if (!wrong.empty()) problems.push_back(source + ": key " + std::to_string(i + 1) + " " + wrong);
  }
}

void read_pem(std::string_view text, const std::string& source, std::vector<JwtKey>& keys,
              std::vector<std::string>& problems) {
  if (text.find("PRIVATE KEY-----") != std::string_view::npos) {
    problems.push_back(source + ": holds a private key; a server needs the public one only");
    return;
  }
  const Owned<BIO, BIO_free_all> file(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
  while (EVP_PKEY* const read = PEM_read_bio_PUBKEY(file.get(), nullptr, nullptr, nullptr)) {
    const Key key = owned(read);
    const std::string algorithm = algorithm_of(read);
    if (algorithm.empty()) {
      problems.push_back(source + ": key " + std::to_string(keys.size() + 1) +
                         " is neither RSA of 2048 bits or more, nor P-256, nor Ed25519");
      return;
    }
    keys.emplace_back(algorithm, "", key);
  }
}

std::string fingerprint_of(ByteView bytes) {
  return "jwt:" + to_hex(ByteView{sha256(bytes)}.first(16));
}

// Converts r and s of a JWS (RFC 7518 section 3.4) to the form that OpenSSL needs; empty: they are
// not valid.
Bytes to_der(ByteView signature) {
  if (signature.size() != 2 * kP256Bytes) return {};
  const Owned<ECDSA_SIG, ECDSA_SIG_free> pair(ECDSA_SIG_new());
  BIGNUM* const r = BN_bin2bn(signature.data(), kP256Bytes, nullptr);
  BIGNUM* const s = BN_bin2bn(signature.data() + kP256Bytes, kP256Bytes, nullptr);
  if (!pair || ECDSA_SIG_set0(pair.get(), r, s) != 1) {
    BN_free(r);
    BN_free(s);
    return {};
  }
  unsigned char* der = nullptr;
  const int size = i2d_ECDSA_SIG(pair.get(), &der);
  if (size <= 0) return {};
  Bytes bytes(der, der + size);
  OPENSSL_free(der);
  return bytes;
}

}  // namespace

JwtKey::JwtKey(std::string algorithm, std::string id, std::shared_ptr<EVP_PKEY> key)
    : algorithm_(std::move(algorithm)), id_(std::move(id)), key_(std::move(key)) {
  unsigned char* der = nullptr;
  const int size = i2d_PUBKEY(key_.get(), &der);
  if (size <= 0) return;
  fingerprint_ = fingerprint_of({der, static_cast<std::size_t>(size)});
  OPENSSL_free(der);
}

JwtKey::JwtKey(std::string id, Bytes secret)
    : algorithm_("HS256"),
      id_(std::move(id)),
      secret_(std::move(secret)),
      fingerprint_(fingerprint_of(secret_)) {}

bool JwtKey::verifies(std::string_view signed_text, ByteView signature) const {
  if (!key_) {
    Digest code{};
    unsigned size = 0;
    return HMAC(EVP_sha256(), secret_.data(), static_cast<int>(secret_.size()),
                view_of(signed_text).data(), signed_text.size(), code.data(), &size) != nullptr &&
           signature.size() == code.size() &&
           CRYPTO_memcmp(code.data(), signature.data(), code.size()) == 0;
  }
  const Bytes der = algorithm_ == "ES256" ? to_der(signature) : Bytes{};
  if (algorithm_ == "ES256") signature = der;
  if (signature.empty()) return false;
  const Owned<EVP_MD_CTX, EVP_MD_CTX_free> context(EVP_MD_CTX_new());
  const EVP_MD* const digest = algorithm_ == "EdDSA" ? nullptr : EVP_sha256();
  return context &&
         EVP_DigestVerifyInit(context.get(), nullptr, digest, nullptr, key_.get()) == 1 &&
         EVP_DigestVerify(context.get(), signature.data(), signature.size(),
                          view_of(signed_text).data(), signed_text.size()) == 1;
}

std::vector<JwtKey> read_jwt_keys(std::string_view text, const std::string& source,
                                  std::vector<std::string>& problems) {
  std::vector<JwtKey> keys;
  const std::size_t before = problems.size();
  if (trim(text).starts_with('{')) {
    read_jwks(text, source, keys, problems);
  } else {
    read_pem(text, source, keys, problems);
  }
  if (problems.size() == before && keys.empty())
    problems.push_back(source + ": holds no key for RS256, ES256, EdDSA or HS256");
  if (keys.size() > kJwtKeysMax)
    problems.push_back(source + ": holds more than " + std::to_string(kJwtKeysMax) + " keys");
  return keys;
}

}  // namespace connect_bridge
