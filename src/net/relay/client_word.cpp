#include "net/relay/client_word.hpp"

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include "core/base/bytes.hpp"
#include "core/base/hex.hpp"
#include "core/base/sha256.hpp"
#include "net/relay/relay_wire.hpp"

namespace connect_bridge {

std::string client_word(const std::string& pin, const std::string& robot) {
  const std::string text = kClientProtocol + (' ' + robot);
  Digest word{};
  unsigned size = 0;
  const bool made =
      !pin.empty() && HMAC(EVP_sha256(), pin.data(), static_cast<int>(pin.size()),
                           view_of(text).data(), text.size(), word.data(), &size) != nullptr;
  return made ? to_hex(word) : std::string{};
}

}  // namespace connect_bridge
