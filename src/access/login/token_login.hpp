// Login by a token that the server knows.
#pragma once

#include <optional>

#include "access/login/authenticator.hpp"
#include "access/login/file_watch.hpp"
#include "access/login/token_ends.hpp"
#include "access/login/token_table.hpp"

namespace connect_bridge {

// Attempts are not slowed down: behind a proxy all clients have one address, and a client with the
// right token must get in whatever others do there. 16 random characters cannot be guessed at any
// rate of attempts.
class TokenLogin : public Authenticator {
 public:
  // Without `file` the table stays as it is; otherwise it was read from there, and is read again
  // when that changes: whole, or not at all.
  // `once`: as in AuthOptions.
  TokenLogin(TokenTable table, std::optional<FileWatch> file, bool strict_modes = true,
             std::string once = {})
      : table_(std::move(table)),
        file_(std::move(file)),
        strict_modes_(strict_modes),
        ends_(std::move(once)) {}

  [[nodiscard]] Judgement judge(const Attempt& attempt, Stamp now) override;
  // Also warns of tokens of the file that end soon.
  [[nodiscard]] Refreshed refresh(Stamp now) override;

  // Reads the file as it is now, changed or not.
  [[nodiscard]] Refreshed read_again(Stamp now);
  // The identity whose token has this digest.
  [[nodiscard]] Judgement find(const Digest& token, Stamp now) const;
  [[nodiscard]] bool knows(const std::string& identity) const { return table_.knows(identity); }

 private:
  TokenTable table_;
  std::optional<FileWatch> file_;
  const bool strict_modes_;
  TokenEnds ends_;
  bool lacks_means_ = false;  // to read the file
};

// All that is wrong with a token file, its permissions and its content, goes to `problems`.
[[nodiscard]] TokenTable read_token_file(const std::string& file, bool strict_modes, Stamp now,
                                         std::vector<Failure>& problems,
                                         std::vector<std::string>& warnings);

}  // namespace connect_bridge
