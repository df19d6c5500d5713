// A server's token file as it is written: by `ctl token` and by pairing.
#pragma once

#include <string>
#include <vector>

#include "auth/secret.hpp"

namespace connect_bridge {

struct TokenEntry {
  std::string identity;
  std::vector<std::string> groups;
  std::string expires;  // 2027-01-31 or 2027-01-31T12:00:00Z; empty: never
  std::string comment;
  Digest digest{};
};

// As it stands in the file, with a line end. Names are written whatever is in them.
[[nodiscard]] std::string to_text(const TokenEntry& entry);

// What is wrong with a text that is to be a file of entries; empty: nothing. `name` is for the
// sentence.
[[nodiscard]] std::string token_entries_problem(const std::string& text, const std::string& name);

// Adds an entry at the end; a file that is missing is made, for its owner alone. The whole file is
// replaced at once, so that a server never reads half of one. Two writers wait
// for each other. Returns what is wrong, empty if nothing; then the file is as it was.
[[nodiscard]] std::string append_token_entry(const std::string& file, const TokenEntry& entry);

}  // namespace connect_bridge
