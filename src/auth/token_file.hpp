// Writing of token files, for `ctl token` and for pairing.
#pragma once

#include <cstddef>
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

// The entry as text of the file, with a line end. Names may have any content.
[[nodiscard]] std::string to_text(const TokenEntry& entry);

// What is wrong with a text that is to be a file of entries; empty: nothing. `name` is used in the
// message.
[[nodiscard]] std::string token_entries_problem(const std::string& text, const std::string& name);

// Replaces the file (if it is a link, that to which it leads) by a new one with the same
// permissions, so that nobody ever reads a half-written file; a missing file is created for its
// owner alone. Returns what is wrong, empty if nothing.
[[nodiscard]] std::string write_secret_file(const std::string& file, const std::string& text);

// Adds an entry at the end, as write_secret_file() does. Two writers wait for each other. Returns
// what is wrong, empty if nothing; then the file is as it was.
[[nodiscard]] std::string append_token_entry(const std::string& file, const TokenEntry& entry);

// This one in place of all entries of its identity, in one step and with the same care; one of them
// must be the token `former`, so that of several who have it one alone succeeds. Waits for other
// writers at most a second: its thread may be everybody's.
[[nodiscard]] std::string replace_token_entries(const std::string& file, const TokenEntry& entry,
                                                const Digest& former);

// Removes all entries of an identity, with the same care; comments stay. `removed`: how many. Only
// entries that stand on lines of their own. Returns what is wrong, empty if nothing; then the file
// is as it was.
[[nodiscard]] std::string remove_token_entries(const std::string& file, const std::string& identity,
                                               std::size_t& removed);

}  // namespace connect_bridge
