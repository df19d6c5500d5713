// Files of tokens as they are written: by `ctl token` and by pairing.
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

// A new file takes the place of the one that is there, with its rights, so that nobody ever reads
// half; one that is missing is made for its owner alone. Returns what is wrong, empty if nothing.
[[nodiscard]] std::string write_secret_file(const std::string& file, const std::string& text);

// Adds an entry at the end, as write_secret_file() does. Two writers wait for each other. Returns
// what is wrong, empty if nothing; then the file is as it was.
[[nodiscard]] std::string append_token_entry(const std::string& file, const TokenEntry& entry);

}  // namespace connect_bridge
