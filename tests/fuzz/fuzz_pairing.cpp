// The line that a server that pairs prints, and the credential that its client shows.
#include <cstddef>
#include <cstdint>
#include <string>

#include "access/login/pairing_login.hpp"
#include "config/invitation.hpp"
#include "core/base/check.hpp"
#include "core/base/hex.hpp"
#include "fuzz/slow.hpp"

using namespace connect_bridge;

namespace {

void check_invitation(const std::string& text) {
  std::string problem;
  const Invitation invitation = parse_invitation(text, problem);
  if (!problem.empty()) return;
  CONNECT_CHECK(invitation.code.size() == kCodeSize);
  CONNECT_CHECK(invitation.url.starts_with("wss://"));
  CONNECT_CHECK(to_text(invitation) == text);
}

// What is told does not contain the code, however the line is cut.
void check_problem(const std::string& written) {
  const std::string code(kCodeSize, 'e');
  std::string problem;
  static_cast<void>(parse_invitation(kInvitationScheme + written + "#" + code + ".x", problem));
  CONNECT_CHECK(!problem.empty() && problem.find(code) == std::string::npos);
}

void check_credential(ByteView bytes) {
  const auto shown = parse_pairing_credential(bytes);
  if (!shown) return;
  CONNECT_CHECK(!shown->name.empty() && pairing_name(shown->name) == shown->name);
  const std::string again = pairing_credential("code", shown->token, shown->name);
  const auto same =
      parse_pairing_credential({reinterpret_cast<const std::uint8_t*>(again.data()), again.size()});
  CONNECT_CHECK(same && same->token == shown->token && same->name == shown->name);
}

void look(const std::uint8_t* data, std::size_t size) {
  const std::string text{reinterpret_cast<const char*>(data), size};
  check_invitation(text);
  check_invitation(kInvitationScheme + text);
  check_problem(text);
  check_credential({data, size});
  const std::string name = pairing_name(text);
  CONNECT_CHECK(!name.empty() && name.size() <= 64);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return quickly("an invitation", [=] { look(data, size); });
}
