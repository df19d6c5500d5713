// Login by a token that the server knows.
#pragma once

#include <algorithm>
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
  // Without `file` the table never changes. Otherwise the table was read from there, and is read
  // again when the file changes: whole, or not at all. `once`: as in AuthOptions.
  TokenLogin(TokenTable table, std::optional<FileWatch> file, bool strict_modes = true,
             std::string once = {})
      : table_(std::move(table)),
        file_(std::move(file)),
        strict_modes_(strict_modes),
        ends_(std::move(once)) {}

  [[nodiscard]] Judgement judge(const Attempt& attempt, Stamp now) override;
  // Reads a changed file, and warns of its tokens that expire soon.
  [[nodiscard]] Refreshed refresh(Stamp now) override;

  // Reads the file as it is now, changed or not. After a failure refresh() reads it again.
  [[nodiscard]] Refreshed read_again(Stamp now);
  // The identity whose token has this digest, or the reason of a refusal.
  [[nodiscard]] Judgement find(const Digest& token, Stamp now) const;
  [[nodiscard]] bool knows(const std::string& identity) const { return table_.knows(identity); }

 private:
  [[nodiscard]] Refreshed read(Stamp now);
  // Now, and never before the file was written: a clock that is behind makes no token valid again.
  [[nodiscard]] Stamp at_least(Stamp now) const {
    return file_ ? std::max(now, file_->written_at()) : now;
  }

  TokenTable table_;
  std::optional<FileWatch> file_;
  const bool strict_modes_;
  TokenEnds ends_;
  bool lacks_means_ = false;  // descriptors or memory, for the file
};

// Reads a token file. All problems with its permissions and its content go to `problems`.
[[nodiscard]] TokenTable read_token_file(const std::string& file, bool strict_modes, Stamp now,
                                         std::vector<Failure>& problems,
                                         std::vector<std::string>& warnings);

}  // namespace connect_bridge
