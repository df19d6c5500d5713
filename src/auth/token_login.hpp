// Login by a token that the server knows.
#pragma once

#include <optional>

#include "auth/authenticator.hpp"
#include "auth/file_watch.hpp"
#include "auth/token_table.hpp"

namespace connect_bridge {

// Nothing slows attempts down: behind a proxy everybody has one address, and who has the right
// token gets in whatever others do there. 16 random characters cannot be guessed at any rate.
class TokenLogin : public Authenticator {
 public:
  // Without `file` the table stays as it is; otherwise it was read from there, and is read again
  // when that changes: whole, or not at all.
  TokenLogin(TokenTable table, std::optional<FileWatch> file)
      : table_(std::move(table)), file_(std::move(file)) {}

  [[nodiscard]] Judgement judge(const Attempt& attempt, Stamp now) override;
  [[nodiscard]] Refreshed refresh(Stamp now) override;

  // Of the file as it is now, changed or not.
  [[nodiscard]] Refreshed read_again(Stamp now);
  // Whose token has this digest.
  [[nodiscard]] TokenTable::Found find(const Digest& token, Stamp now) const;
  [[nodiscard]] bool knows(const std::string& identity) const { return table_.knows(identity); }

 private:
  TokenTable table_;
  std::optional<FileWatch> file_;
};

// All that is wrong with a file of tokens, its rights and its content, goes to `problems`.
[[nodiscard]] TokenTable read_token_file(const std::string& file, Stamp now,
                                         std::vector<std::string>& problems,
                                         std::vector<std::string>& warnings);

}  // namespace connect_bridge
