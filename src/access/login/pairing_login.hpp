// Login by a one-time code: the token of a client that sends it is added to the token file.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "access/login/authenticator.hpp"
#include "access/login/secret.hpp"
#include "access/login/token_login.hpp"

namespace connect_bridge {

// The login method of a client that pairs. Its credential is "CODE DIGEST NAME": the code, the
// token's SHA-256 in 64 hexadecimal digits, and the client's name, 1 to 64 of [A-Za-z0-9_.-]. The
// client has made the token, and does not send it before it logs in with it.
inline constexpr char kPairingLogin[] = "pair";

[[nodiscard]] std::string pairing_credential(const std::string& code, const Digest& token,
                                             const std::string& name);

struct PairingCredential {
  Digest code{};  // of the code that the client sent
  Digest token{};
  std::string name;
};
// Parses any bytes; nullopt: they are not a credential of a pairing.
[[nodiscard]] std::optional<PairingCredential> parse_pairing_credential(ByteView credential);

// Makes a client's name from a host name: characters that are not allowed become '-', and it is cut
// to 64 bytes.
[[nodiscard]] std::string pairing_name(const std::string& host);

// Invites one client, which gets these groups, to the server that reads this file: the running one,
// or the next one. The file has only the code's hash, and replaces an invitation that was not taken
// yet. Returns the problem; empty: none.
[[nodiscard]] std::string write_invited(const std::string& file, const std::string& code,
                                        const std::vector<std::string>& groups);

// The login of a server that pairs. Logins of other methods go to the token login. An invitation is
// taken from its file, which is then removed, at a login and once a second. It replaces the one
// before. One client can pair with a code: a second one is refused. The same client may log in with
// the code again until the pairing expires, because the answer to its first login may have been
// lost. Wrong codes do not end a pairing: nobody guesses 128 random bits, and anybody who reaches
// the port could end it. One thread.
class PairingLogin : public Authenticator {
 public:
  // The new client's entry goes to the token file, from which `tokens` was made. An invitation that
  // is already in its file is removed: no server has taken it in time.
  PairingLogin(PairingOptions options, std::string token_file, std::unique_ptr<TokenLogin> tokens);

  [[nodiscard]] Judgement judge(const Attempt& attempt, Stamp now) override;
  [[nodiscard]] Refreshed refresh(Stamp now) override;

 private:
  [[nodiscard]] Judgement pair(const Attempt& attempt, Stamp now);
  [[nodiscard]] Judgement add(const Digest& token, const std::string& name, const Attempt& attempt,
                              Stamp now);
  struct Invited {
    Digest code{};
    std::vector<std::string> groups;
    std::chrono::steady_clock::time_point until;
    std::optional<Digest> paired;  // digest of the token of the client that has used the code
  };

  void take_invited();
  [[nodiscard]] bool is_over() const;
  void end(std::string news);

  const PairingOptions options_;
  const std::string token_file_;
  std::unique_ptr<TokenLogin> tokens_;
  std::optional<Invited> invited_;
  bool stays_ = false;  // a file of an invitation that cannot be removed was reported
  Refreshed unreported_;
};

}  // namespace connect_bridge
