// Login by a one-time code: the token of a client that shows it is added to the token file.
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
// SHA-256 of the token that the client has made for itself in 64 hexadecimal digits, and its name,
// 1 to 64 of [A-Za-z0-9_.-]. The token itself is not sent before it is used.
inline constexpr char kPairingLogin[] = "pair";

[[nodiscard]] std::string pairing_credential(const std::string& code, const Digest& token,
                                             const std::string& name);

struct PairingCredential {
  Digest code{};  // of the code that was shown
  Digest token{};
  std::string name;
};
// nullopt: it is none. Any bytes.
[[nodiscard]] std::optional<PairingCredential> parse_pairing_credential(ByteView credential);

// Makes a client's name from a host name: characters that are not allowed become '-', and it is cut
// to 64 bytes.
[[nodiscard]] std::string pairing_name(const std::string& host);

// Invites one client, which gets these groups, to the server that looks into this file: the one
// that runs, or the next one. The file has the code's hash alone, and replaces an invitation that
// was not taken yet. Returns what is wrong, empty if nothing.
[[nodiscard]] std::string write_invited(const std::string& file, const std::string& code,
                                        const std::vector<std::string>& groups);

// Logins of other methods go to the token login. An invitation is taken from its file, which is
// removed, at a login and once a second, and replaces the one before. One client can pair with a
// code: a second one is refused, but the same client may log in with it again until the pairing
// ends, because the answer to its first login may have been lost. Wrong codes end nothing: nobody
// guesses 128 random bits, and whoever reaches the port could end a pairing. One thread.
class PairingLogin : public Authenticator {
 public:
  // The token file, from which `tokens` was made, gets the new client's entry. An invitation that
  // is in its file already is one that no server has taken in time: it is removed.
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
  bool stays_ = false;  // an invitation that cannot be removed was reported
  Refreshed untold_;
};

}  // namespace connect_bridge
