// JSON Web Tokens of strangers, and files of keys: an identity only by a right signature, and only
// with an end. Input: a flag byte, then a token, a payload to be signed, or keys.
#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "access/plugins/jwt_login.hpp"
#include "core/base/base64.hpp"
#include "core/base/check.hpp"
#include "fuzz/slow.hpp"

using namespace connect_bridge;

namespace {

constexpr Stamp kNow = 1'800'000'000'000'000'000;
const Bytes kSecret(32, 7);

std::string signed_token(std::string_view payload) {
  std::string text =
      to_base64url(view_of(R"({"alg":"HS256"})")) + "." + to_base64url(view_of(payload));
  unsigned char code[32];
  unsigned size = 0;
  HMAC(EVP_sha256(), kSecret.data(), static_cast<int>(kSecret.size()), view_of(text).data(),
       text.size(), code, &size);
  return text + "." + to_base64url({code, size});
}

void look(const std::uint8_t* data, std::size_t size) {
  static const JwtOptions options{"i", "a", "groups"};
  static const std::vector<JwtKey> keys{JwtKey("k", kSecret)};
  if (size == 0) return;
  const std::string_view text{reinterpret_cast<const char*>(data + 1), size - 1};
  if (data[0] % 3 == 0) {
    std::vector<std::string> problems;
    const auto read = read_jwt_keys(text, "f", problems);
    CONNECT_CHECK(!read.empty() || !problems.empty());
    return;
  }
  const std::string token = data[0] % 3 == 1 ? std::string{text} : signed_token(text);
  const Judgement judged = judge_jwt(token, keys, options, kNow);
  CONNECT_CHECK(judged.identity.has_value() == judged.reason.empty());
  if (!judged.identity) return;
  CONNECT_CHECK(judged.identity->expires > kNow && !judged.identity->name.empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return quickly("a JWT", [=] { look(data, size); });
}
