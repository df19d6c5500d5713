// JSON Web Tokens of strangers, and files of keys: an identity only by a right signature, and only
// with an end. Input: a flag byte, then a token, a payload to be signed, or keys.
#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "auth/jwt_login.hpp"
#include "core/base/check.hpp"

using namespace connect_bridge;

namespace {

constexpr Stamp kNow = 1'800'000'000'000'000'000;
const Bytes kSecret(32, 7);

std::string base64url(std::string_view text) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::string result;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    bits = bits << 8 | static_cast<std::uint8_t>(c);
    for (count += 8; count >= 6; count -= 6) result += kDigits[bits >> (count - 6) & 63];
    bits &= 63;
  }
  if (count > 0) result += kDigits[bits << (6 - count) & 63];
  return result;
}

std::string signed_token(std::string_view payload) {
  std::string text = base64url(R"({"alg":"HS256"})") + "." + base64url(payload);
  unsigned char code[32];
  unsigned size = 0;
  HMAC(EVP_sha256(), kSecret.data(), static_cast<int>(kSecret.size()),
       reinterpret_cast<const unsigned char*>(text.data()), text.size(), code, &size);
  return text + "." + base64url({reinterpret_cast<const char*>(code), size});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const JwtOptions options{"", {}, "i", "a", {"RS256", "ES256", "EdDSA", "HS256"}, "groups"};
  static const std::vector<JwtKey> keys{JwtKey("k", kSecret)};
  if (size == 0) return 0;
  const std::string_view text{reinterpret_cast<const char*>(data + 1), size - 1};
  if (data[0] % 3 == 0) {
    std::vector<std::string> problems;
    const auto read = read_jwt_keys(text, "f", problems);
    CONNECT_CHECK(!read.empty() || !problems.empty());
    return 0;
  }
  const std::string token = data[0] % 3 == 1 ? std::string{text} : signed_token(text);
  const Judgement judged = judge_jwt(token, keys, options, kNow);
  CONNECT_CHECK(judged.identity.has_value() == judged.reason.empty());
  if (!judged.identity) return 0;
  CONNECT_CHECK(judged.identity->expires > kNow && !judged.identity->name.empty());
  return 0;
}
